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
        if not np.isfinite(squares.sum()):
            break  # something lies behind the camera, where there is no way back
        # Turns and shifts differ in size by a thousand, so the damping goes by the diagonal (Marquardt).
        step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), -gradient).astype(np.float64)
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
    by_u, by_v = np.zeros(6), np.zeros(6)
    for n in range(count):
        p, q, r = points[n, 0], points[n, 1], points[n, 2]
        tx = rotation[0, 0] * p + rotation[0, 1] * q + rotation[0, 2] * r
        ty = rotation[1, 0] * p + rotation[1, 1] * q + rotation[1, 2] * r
        tz = rotation[2, 0] * p + rotation[2, 1] * q + rotation[2, 2] * r
        z = tz + translation[2]
        if z <= 1e-6:
            squares[n] = np.inf
            continue
        u, v = (tx + translation[0]) / z, (ty + translation[1]) / z
        # By a shift (a, 0, c) and (0, a, d), and by a turn about the room's origin the cross product with it.
        a, c, d = 1.0 / z, -u / z, -v / z
        by_u[0], by_u[1], by_u[2], by_u[3], by_u[5] = c * ty, a * tz - c * tx, -a * ty, a, c
        by_v[0], by_v[1], by_v[2], by_v[4], by_v[5] = d * ty - a * tz, -d * tx, a * tx, a, d
        off_u, off_v = u - slopes[n, 0], v - slopes[n, 1]
        uu, uv, vv = information[n, 0, 0], information[n, 0, 1], information[n, 1, 1]
        first, second = uu * off_u + uv * off_v, uv * off_u + vv * off_v
        squares[n] = off_u * first + off_v * second
        for i in range(6):
            gradient[i] += by_u[i] * first + by_v[i] * second
            left, right = uu * by_u[i] + uv * by_v[i], uv * by_u[i] + vv * by_v[i]
            for j in range(i + 1):
                normal[i, j] += left * by_u[j] + right * by_v[j]
    for i in range(6):
        for j in range(i):
            normal[j, i] = normal[i, j]
    return squares, normal, gradient


@compiled
def turn(vector: FloatArray) -> FloatArray:
    """The rotation matrix of a rotation vector (3,), rad (Rodrigues)."""
    angle = np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    matrix = np.zeros((3, 3))
    matrix[0, 1], matrix[0, 2], matrix[1, 2] = -vector[2], vector[1], -vector[0]
    matrix = matrix - matrix.T
    if angle < 1e-8:
        return np.eye(3) + matrix
    rotation: FloatArray = (
        np.eye(3) + np.sin(angle) / angle * matrix + (1.0 - np.cos(angle)) / angle**2 * matrix @ matrix
    )
    return rotation
