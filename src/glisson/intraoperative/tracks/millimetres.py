"""Tracks in millimetres: by a scale, or by a calibrated camera whose poses are known."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import BadInput
from glisson.core.tracks import Tracks
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import directions

_STEP_PX = 0.5


def scaled(tracks: Tracks, mm_per_px: float) -> Tracks:
    """Tracks in mm in the plane of the image, where a pixel is so large at the tissue.

    Raises:
        BadInput: the tracks are not in px, or the scale is not positive.
    """
    if tracks.unit != "px":
        raise BadInput("The tracks are in mm already; give no scale.")
    if not (np.isfinite(mm_per_px) and mm_per_px > 0.0):
        raise BadInput(f"The size of a pixel at the tissue must be positive, not {mm_per_px} mm.")
    return replace(tracks, places=mm_per_px * tracks.places, covariance=mm_per_px**2 * tracks.covariance, unit="mm")


def at_distance(tracks: Tracks, camera: Camera, distance_mm: float) -> Tracks:
    """Tracks in mm across a calibrated camera's axis, without its distortion, of tissue at a distance along the axis.

    Raises:
        BadInput: the tracks are not in px or lie outside the camera's image, or the distance is not positive.
    """
    if not (np.isfinite(distance_mm) and distance_mm > 0.0):
        raise BadInput(f"The tissue's distance must be positive, not {distance_mm} mm.")
    outside = (tracks.places < -0.5) | (tracks.places > np.array([camera.width, camera.height]) - 0.5)
    if tracks.unit == "px" and outside.any():
        raise BadInput(
            f"The tracks leave the camera's image of {camera.width} × {camera.height} px; give the camera that took "
            "the video."
        )
    still = RigidTransform("room", "camera", np.eye(3), np.zeros(3))
    points, covariance = on_plane(tracks, camera, [still], [0.0, 0.0, distance_mm], [0.0, 0.0, 1.0])
    return replace(tracks, places=points[:, :, :2], covariance=covariance[:, :, :2, :2], unit="mm")


def on_plane(
    tracks: Tracks,
    camera: Camera,
    room_from_camera: Sequence[RigidTransform],
    point_mm: ArrayLike,
    normal: ArrayLike,
) -> tuple[FloatArray, FloatArray]:
    """Points (n, m, 3) mm in the room, and their covariance (n, m, 3, 3), of markers that lie on a plane there.

    A scope that moves is allowed for by its pose in each frame (taken as exact). NaN where a marker is lost.

    Args:
        tracks: in px, of n frames.
        camera: the scope's.
        room_from_camera: a pose for each frame, or one for all.
        point_mm: (3,) on the plane, in the room.
        normal: (3,) of the plane.

    Raises:
        BadInput: the tracks are not in px, or there are neither one nor n poses.
    """
    if tracks.unit != "px":
        raise BadInput("Only tracks in px can be put onto a plane.")
    if len(room_from_camera) not in (1, len(tracks.times_s)):
        raise BadInput(f"There are {len(room_from_camera)} poses for {len(tracks.times_s)} frames.")
    steps = _STEP_PX * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    points = np.full((*tracks.states.shape, 3), np.nan)
    covariance = np.full((*tracks.states.shape, 3, 3), np.nan)
    for n, seen in enumerate(tracks.seen):
        if not seen.any():
            continue
        pose = room_from_camera[n if len(room_from_camera) > 1 else 0]
        pixels = tracks.places[n, seen][:, None, :] + steps
        rays = directions(camera, pixels.reshape(-1, 2)) @ pose.rotation.T
        depth = (np.asarray(point_mm) - pose.translation_mm) @ np.asarray(normal) / (rays @ np.asarray(normal))
        hits = (pose.translation_mm + depth[:, None] * rays).reshape(-1, 5, 3)
        jacobian = np.stack([hits[:, 1] - hits[:, 2], hits[:, 3] - hits[:, 4]], axis=2) / (2.0 * _STEP_PX)
        points[n, seen] = hits[:, 0]
        covariance[n, seen] = jacobian @ tracks.covariance[n, seen] @ np.swapaxes(jacobian, 1, 2)
    return points, covariance
