"""Whether two pixels can show one point, given where the scopes were measured to be."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.views import View
from glisson.intraoperative.cameras.projection import directions


def epipolar_statistics(
    one: View, two: View, pixels: tuple[FloatArray, FloatArray], sigma_px: float, hand_eye: FloatArray | None = None
) -> FloatArray:
    """Squared misses (n,) of rays in their standard deviations; of one degree of freedom where a pair belongs together.

    The miss is the triple product of the baseline and the two rays; its variance has the errors of both poses, of
    what they have in common, and of the pixels.

    Args:
        one: the first view.
        two: the second.
        pixels: (n, 2) in each.
        sigma_px: standard deviation of each coordinate.
        hand_eye: (6, 6) as in `ViewSet`.
    """
    poses = (one.room_from_camera, two.room_from_camera)
    first, second = (
        directions(view.camera, seen) @ pose.rotation.T
        for view, pose, seen in zip((one, two), poses, pixels, strict=True)
    )
    base = poses[1].translation_mm - poses[0].translation_mm
    normal = np.cross(first, second)
    by_first, by_second = np.cross(second, base), np.cross(base, first)
    miss = normal @ base
    gradients = [
        np.concatenate([np.cross(first, by_first), -normal], axis=1),
        np.concatenate([np.cross(second, by_second), normal], axis=1),
    ]
    variance = np.zeros(len(miss))
    common = np.zeros((len(miss), 6))
    for pose, gradient in zip(poses, gradients, strict=True):
        assert pose.covariance is not None  # a view has one
        variance += np.einsum("ni,ij,nj->n", gradient, pose.covariance, gradient)
        common += gradient @ np.kron(np.eye(2), pose.rotation)
    if hand_eye is not None:
        variance += np.einsum("ni,ij,nj->n", common, hand_eye, common)
    for view, by_ray in zip((one, two), (by_first, by_second), strict=True):
        variance += (sigma_px / view.camera.focal_px.mean()) ** 2 * (by_ray**2).sum(axis=1)
    statistics: FloatArray = miss**2 / np.maximum(variance, 1e-30)
    return statistics
