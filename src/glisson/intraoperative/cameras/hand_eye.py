"""Hand–eye calibration: where the camera is in the frame of the marker that the tracker sees on it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.board_pose import BoardPose, board_pose
from glisson.intraoperative.cameras.hand_eye_checks import check_fit, check_views
from glisson.intraoperative.cameras.hand_eye_closed_form import hand_eye_closed_form
from glisson.intraoperative.cameras.hand_eye_equations import (
    HandEyeView,
    camera_steps,
    linearised,
    moved_camera,
    tracked,
)
from glisson.intraoperative.cameras.projection import project
from glisson.intraoperative.cameras.turning import turning

_PATIENCE = 5.0
_STARTS = ((1e-3, 0.1, 1.0), (1e-5, 1e-3, 10.0), (1e-4, 0.05, 3.0))
"""Errors of a tracker in rad and mm, and of a board in standard deviations of a pixel, to begin with."""


@dataclass(frozen=True, eq=False)
class HandEye:
    """How camera and board are fixed to what is tracked.

    Args:
        camera_from_marker: with covariance.
        base_from_board: "base" is the board's marker, or the room where it has none; with covariance.
        camera: as the tracked poses correct it within its covariance; it belongs to these poses.
        rms_px: root mean square distance between board points found and reprojected through the tracker.
        rms_mm: root mean square distance between the board's middle as tracked and as seen.
        rms_deg: the same of its turn.
        rms_px_of_views: `rms_px` of each view.
        residuals_px: found minus reprojected (n, 2) of each view.
        sigma_px: standard deviation of a coordinate of a found point.
        board_sigma_px: how far the points of a board err together, as the residuals show it: from blur, print or a
            distortion that the camera lacks.
        tracker_sigma_deg: standard deviation of a tracked angle about each axis, as the residuals show it.
        tracker_sigma_mm: standard deviation of a tracked coordinate.
        turned_deg: root mean square angles between poses about the two main axes.
        notes: sentences on what a person should look at.
    """

    camera_from_marker: RigidTransform
    base_from_board: RigidTransform
    camera: Camera
    rms_px: float
    rms_mm: float
    rms_deg: float
    rms_px_of_views: tuple[float, ...]
    residuals_px: tuple[FloatArray, ...]
    sigma_px: float
    board_sigma_px: float
    tracker_sigma_deg: float
    tracker_sigma_mm: float
    turned_deg: tuple[float, float]
    notes: tuple[str, ...]


def calibrate_hand_eye(camera: Camera, views: Sequence[HandEyeView]) -> HandEye:
    """Hand–eye and robot–world calibration together: A = X B Z, with A and B of each view, X and Z sought.

    The closed form of `hand_eye_closed_form` is refined: what the views say is weighted by the information of their
    pixels on the board's pose, by the errors of the tracker in angle and place, and by errors that all points of a
    board share; the sizes of these three the residuals tell. The
    camera may move within its covariance. To first order this is a bundle adjustment of reprojected points with the
    true tracked poses and the intrinsics among the unknowns. (Least squares of pixels alone, as if the tracker were
    exact, put the camera ten times farther off in simulations.)

    Raises:
        BadInput: fewer than three views, or a second marker in some only.
        StageFailed: unobservable (poses nearly parallel), a board whose pose is ambiguous, or poses that do not belong
            to the images.
    """
    check_views(views)
    boards = [board_pose(camera, view.board) for view in views]
    poses = hand_eye_closed_form([board.camera_from_board for board in boards], [tracked(view) for view in views])
    sigma_px = _pixel_sigma(boards)
    starts, steps = np.array(_STARTS) * [1.0, 1.0, sigma_px], camera_steps(camera)
    for number in range(4):
        blocks = linearised(poses, boards, views, sigma_px, steps)
        if number < 2:  # later the sizes change no more
            sizes = blocks.sizes(starts)
            starts = sizes[None]
        step, normal = blocks.solved(sizes)
        poses = poses[0].moved(step[:6]), poses[1].moved(step[6:12])
    covariance = blocks.covariance(normal)
    corrected = moved_camera(camera, steps @ step[12:])
    if camera.covariance is not None:
        corrected = replace(corrected, covariance=steps @ covariance[12:, 12:] @ steps.T)
    poses = replace(poses[0], covariance=covariance[:6, :6]), replace(poses[1], covariance=covariance[6:12, 6:12])
    sigmas = sigma_px, float(sizes[2]), float(np.degrees(sizes[0])), float(sizes[1])
    check_fit(views, boards, camera.width, sigmas[1:])
    return _told(corrected, views, poses, sigmas)


def _pixel_sigma(boards: Sequence[BoardPose]) -> float:
    squares = sum(float((board.residuals_px**2).sum()) for board in boards)
    return float(np.sqrt(squares / sum(board.residuals_px.size - 6 for board in boards)))


def _told(
    camera: Camera,
    views: Sequence[HandEyeView],
    poses: tuple[RigidTransform, RigidTransform],
    sigmas: tuple[float, float, float, float],
) -> HandEye:
    residuals, apart_mm, apart_deg = [], [], []
    for view in views:
        through = poses[0].after(tracked(view)).after(poses[1])
        residuals.append(view.board.pixels - project(camera, through, view.board.points_mm))
        middle = view.board.points_mm.mean(axis=0)
        seen = board_pose(camera, view.board).camera_from_board
        apart_mm.append(float(np.linalg.norm(seen.apply(middle) - through.apply(middle))))
        apart_deg.append(float(np.degrees(Rotation.from_matrix(seen.rotation @ through.rotation.T).magnitude())))
    squares = [(rows**2).sum(axis=1) for rows in residuals]
    turned = turning([tracked(view).rotation.T for view in views])
    return HandEye(
        *poses,
        camera,
        float(np.sqrt(np.concatenate(squares).mean())),
        float(np.sqrt(np.mean(np.square(apart_mm)))),
        float(np.sqrt(np.mean(np.square(apart_deg)))),
        tuple(float(np.sqrt(one.mean())) for one in squares),
        tuple(residuals),
        *sigmas,
        (turned.about_first_deg, turned.about_second_deg),
        _notes(views, apart_mm, poses[0]),
    )


def _notes(views: Sequence[HandEyeView], apart_mm: Sequence[float], pose: RigidTransform) -> tuple[str, ...]:
    assert pose.covariance is not None  # it was just given one
    notes = []
    if len(views) < 6:
        notes.append(f"{len(views)} views are few; 10 or more tell more surely.")
    usual = float(np.median(apart_mm))
    for view, own in zip(views, apart_mm, strict=True):
        if own > max(_PATIENCE * usual, 1.0):
            notes.append(
                f"{view.board.name} fits worse than the others ({own:.1f} mm against {usual:.1f} mm): was everything "
                "at rest, and are image and pose of the same moment?"
            )
    sigma = float(np.sqrt(np.linalg.eigvalsh(pose.covariance[3:, 3:])[-1]))
    if sigma > 2.0:
        notes.append(f"The place of the camera is known to {sigma:.1f} mm only (one standard deviation): turn further.")
    return tuple(notes)
