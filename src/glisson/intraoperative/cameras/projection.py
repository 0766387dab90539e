"""Pixels of points and directions of pixels, for a calibrated camera."""

import cv2
import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.transform import RigidTransform


def project(camera: Camera, camera_from_world: RigidTransform, points_mm: ArrayLike) -> FloatArray:
    """Pixels (n, 2) of points (n, 3) of the transform's source frame.

    Points behind the camera have pixels, too: whoever may have such asks for their depth.
    """
    pixels, _ = project_with_jacobian(camera, camera_from_world, points_mm)
    return pixels


def project_with_jacobian(
    camera: Camera, camera_from_world: RigidTransform, points_mm: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Pixels (n, 2), and their derivative (n, 2, 15).

    It is by the pose (d and e of `RigidTransform`), the focal lengths, the principal point and the distortion.
    """
    points = np.asarray(points_mm, dtype=np.float64).reshape(-1, 3)
    turned = points @ camera_from_world.rotation.T
    # A rotation vector of zero, so that OpenCV differentiates by a small turn on the left.
    pixels, jacobian = cv2.projectPoints(
        turned.reshape(-1, 1, 3), np.zeros(3), camera_from_world.translation_mm, camera.matrix, camera.distortion
    )
    by_all = jacobian.reshape(len(points), 2, -1)[:, :, :15]
    return pixels.reshape(-1, 2).astype(np.float64), by_all.astype(np.float64)


def directions(camera: Camera, pixels: ArrayLike) -> FloatArray:
    """Unit vectors (n, 3) in the camera's frame from its centre through pixels (n, 2)."""
    rays = np.ones((np.asarray(pixels).size // 2, 3))
    rays[:, :2] = undistorted(camera, pixels)
    unit: FloatArray = rays / np.linalg.norm(rays, axis=1, keepdims=True)
    return unit


def undistorted(camera: Camera, pixels: ArrayLike) -> FloatArray:
    """The slopes x / z and y / z (n, 2) of what is seen at pixels (n, 2)."""
    given = np.asarray(pixels, dtype=np.float64).reshape(-1, 1, 2)
    if not len(given):
        return given.reshape(0, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-12)
    flat = cv2.undistortPoints(given, camera.matrix, camera.distortion, criteria=criteria)
    return np.asarray(flat, dtype=np.float64).reshape(-1, 2)
