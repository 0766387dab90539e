"""A pose by least squares of weighted reprojection errors (Levenberg and Marquardt, six unknowns)."""

from typing import NamedTuple

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.geometry.compiled import compiled

_ITERATIONS = 30


class RefinedPose(NamedTuple):
    """`camera_from_room` at a minimum.

    `squares` (n,) are the squared errors of the points in units of their covariance; infinite behind the camera.
    `normal` (6, 6) is the matrix of the normal equations over d and e of `RigidTransform`, the inverse covariance.
    """

    rotation: FloatArray
    translation_mm: FloatArray
    squares: FloatArray
    normal: FloatArray


@compiled
def refined_pose(
    points: FloatArray, slopes: FloatArray, information: FloatArray, rotation: FloatArray, translation: FloatArray
) -> RefinedPose:
    """The minimum next to a pose.

    Args:
        points: in the room (n, 3), mm.
        slopes: where they are seen, x / z and y / z (n, 2).
        information: inverse covariance of the slopes (n, 2, 2).
        rotation: of camera_from_room (3, 3) to begin with.
        translation: the same (3,), mm.
    """
    damping = 1e-6
    squares, normal, gradient = normal_equations(points, slopes, information, rotation, translation)
    for _ in range(_ITERATIONS):
        # Turns and shifts differ in size by a thousand, so the damping goes by the diagonal (Marquardt).
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -gradient)
        turned = turn(step[:3]) @ rotation
        moved = translation + step[3:]
        tried, its_normal, its_gradient = normal_equations(points, slopes, information, turned, moved)
        if tried.sum() <= squares.sum():
            gain = squares.sum() - tried.sum()
            rotation, translation = turned, moved
            squares, normal, gradient = tried, its_normal, its_gradient
            damping = max(damping * 0.1, 1e-12)
            if gain <= 1e-9 * (1.0 + squares.sum()):
                break
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return RefinedPose(rotation, translation, squares, normal)


@compiled
def normal_equations(
    points: FloatArray, slopes: FloatArray, information: FloatArray, rotation: FloatArray, translation: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Squared errors (n,), their normal matrix (6, 6) and gradient (6,); arguments as `refined_pose`."""
    count = len(points)
    squares = np.zeros(count)
    normal, gradient = np.zeros((6, 6)), np.zeros(6)
    slope = np.zeros((2, 6))
    for n in range(count):
        turned = rotation @ points[n]
        x, y, z = turned[0] + translation[0], turned[1] + translation[1], turned[2] + translation[2]
        if z <= 1e-6:
            squares[n] = np.inf
            continue
        u, v = x / z, y / z
        slope[0, 3], slope[0, 4], slope[0, 5] = 1.0 / z, 0.0, -u / z
        slope[1, 3], slope[1, 4], slope[1, 5] = 0.0, 1.0 / z, -v / z
        for row in range(2):
            a, b, c = slope[row, 3], slope[row, 4], slope[row, 5]
            slope[row, 0] = c * turned[1] - b * turned[2]
            slope[row, 1] = a * turned[2] - c * turned[0]
            slope[row, 2] = b * turned[0] - a * turned[1]
        error = np.array([u - slopes[n, 0], v - slopes[n, 1]])
        weighted = information[n] @ error
        squares[n] = error @ weighted
        for i in range(6):
            gradient[i] += slope[0, i] * weighted[0] + slope[1, i] * weighted[1]
            first = information[n, 0, 0] * slope[0, i] + information[n, 0, 1] * slope[1, i]
            second = information[n, 1, 0] * slope[0, i] + information[n, 1, 1] * slope[1, i]
            for j in range(6):
                normal[i, j] += first * slope[0, j] + second * slope[1, j]
    return squares, normal, gradient


@compiled
def turn(vector: FloatArray) -> FloatArray:
    """The rotation matrix of a rotation vector (3,), rad (Rodrigues)."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    matrix = np.zeros((3, 3))
    matrix[0, 1], matrix[0, 2], matrix[1, 2] = -vector[2], vector[1], -vector[0]
    matrix = matrix - matrix.T
    if angle < 1e-8:
        return np.eye(3) + matrix + 0.5 * matrix @ matrix
    return (
        np.eye(3) + np.sin(angle) / angle * matrix + (1.0 - np.cos(angle)) / angle**2 * matrix @ matrix
    )
