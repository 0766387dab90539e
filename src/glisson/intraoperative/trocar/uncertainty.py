"""What noise, calibration and the places of crosses leave open in corners and in the pose that they give."""

from dataclasses import replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import project_with_jacobian
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.refinement import RefinedPose


def loosened(seen: SeenCorners, pose: RefinedPose, camera: Camera, layout: CrossLayout) -> SeenCorners:
    """Corners with what calibration and places leave of each added to its own noise, at about the pose."""
    if _is_exact(seen, camera, layout):
        return seen
    by_pose, by_camera = _derivatives(seen, pose, camera)
    spread = np.zeros((len(seen), 2, 2))
    if camera.covariance is not None:
        spread += by_camera @ camera.covariance @ by_camera.transpose(0, 2, 1)
    by_place, covariances = _by_place(seen, pose, by_pose, layout)
    spread += by_place @ covariances[seen.cross] @ by_place.transpose(0, 2, 1)
    information = np.linalg.inv(np.linalg.inv(seen.information) + spread)
    return replace(seen, information=np.asarray(information, dtype=np.float64))


def pose_covariance(
    pose: RefinedPose, used: SeenCorners, weights: FloatArray, scale: float, camera: Camera, layout: CrossLayout
) -> FloatArray:
    """Covariance (6, 6) of a pose by least squares.

    What is common to all corners (calibration) or to those of a cross (its place) is not averaged away.

    Args:
        pose: the minimum.
        used: its corners with their own noise.
        weights: inverse covariances (n, 2, 2) with which they were weighted.
        scale: factor to the corners' standard deviations.
        camera: with covariance, if known.
        layout: with covariances of the places, if known.
    """
    if _is_exact(used, camera, layout) and used.growth_covariance is None:
        return np.asarray(np.linalg.inv(pose.normal) * scale**2, dtype=np.float64)
    by_pose, by_camera = _derivatives(used, pose, camera)
    gain = np.linalg.solve(pose.normal, by_pose.transpose(0, 2, 1) @ weights)
    noise = np.asarray(np.linalg.inv(used.information), dtype=np.float64)
    total: FloatArray = (gain @ noise @ gain.transpose(0, 2, 1)).sum(axis=0) * scale**2
    if camera.covariance is not None:
        of_camera = (gain @ by_camera).sum(axis=0)
        total += of_camera @ camera.covariance @ of_camera.T
    if used.growth is not None and used.growth_covariance is not None:
        of_growth = (gain @ used.growth).sum(axis=0)
        total += of_growth @ used.growth_covariance @ of_growth.T * scale**2
    by_place, covariances = _by_place(used, pose, by_pose, layout)
    of_places = np.zeros((len(layout), 6, 6))
    np.add.at(of_places, used.cross, gain @ by_place)
    spread: FloatArray = total + (of_places @ covariances @ of_places.transpose(0, 2, 1)).sum(axis=0)
    return spread


def _is_exact(seen: SeenCorners, camera: Camera, layout: CrossLayout) -> bool:
    places = (layout.crosses[number].room_from_cross for number in seen.crosses)
    return camera.covariance is None and all(place.covariance is None for place in places)


def _derivatives(seen: SeenCorners, pose: RefinedPose, camera: Camera) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the slopes by the pose (n, 2, 6), and by focal lengths, principal point, distortion (n, 2, 9)."""
    transform = RigidTransform("camera", "room", pose.rotation, pose.translation_mm)
    _, by_all = project_with_jacobian(camera, transform, seen.points_mm)
    return slopes_by_pose(seen, pose), by_all[:, :, 6:] / camera.focal_px[:, None]


def slopes_by_pose(seen: SeenCorners, pose: RefinedPose) -> FloatArray:
    """Derivatives (n, 2, 6) of the slopes by d and e of `RigidTransform`."""
    in_camera = seen.points_mm @ pose.rotation.T + pose.translation_mm
    turned = in_camera - pose.translation_mm
    depth, slopes = in_camera[:, 2:], in_camera[:, :2] / in_camera[:, 2:]
    by_shift = np.zeros((len(seen), 2, 3))
    by_shift[:, 0, 0] = by_shift[:, 1, 1] = 1.0 / depth[:, 0]
    by_shift[:, :, 2] = -slopes / depth
    # A turn d moves the point by d × turned.
    by_turn = np.cross(turned[:, None], by_shift)
    return np.concatenate([by_turn, by_shift], axis=2)


def _by_place(
    seen: SeenCorners, pose: RefinedPose, by_pose: FloatArray, layout: CrossLayout
) -> tuple[FloatArray, FloatArray]:
    """Derivatives (n, 2, 6) of the slopes by the pose of their cross, and covariances (crosses, 6, 6) of all places."""
    places = [cross.room_from_cross for cross in layout.crosses]
    middles = np.array([place.translation_mm for place in places])
    covariances = np.array([np.zeros((6, 6)) if one.covariance is None else one.covariance for one in places])
    arms = seen.points_mm - middles[seen.cross]
    by_point = by_pose[:, :, 3:] @ pose.rotation
    # A turn d moves the corner by d × arm.
    return np.concatenate([np.cross(arms[:, None], by_point), by_point], axis=2), covariances
