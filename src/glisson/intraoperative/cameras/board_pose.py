"""The pose of a flat board before a calibrated camera, its covariance, and its mirror pose."""

from dataclasses import dataclass

import cv2
import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.adjustment import NormalEquations, inverse, minimum
from glisson.intraoperative.cameras.boards import BoardView
from glisson.intraoperative.cameras.projection import project_with_jacobian, undistorted


@dataclass(frozen=True, eq=False)
class BoardPose:
    """`camera_from_board` without covariance, and what it rests on.

    Args:
        camera_from_board: the pose.
        cofactor: its covariance (6, 6) for points found to 1 px, the camera being exact.
        by_camera: its derivative (6, 9) by the camera's intrinsics.
        residuals_px: found minus computed (n, 2).
    """

    camera_from_board: RigidTransform
    cofactor: FloatArray
    by_camera: FloatArray
    residuals_px: FloatArray


def board_pose(camera: Camera, view: BoardView) -> BoardPose:
    """The pose with the least squares of pixels.

    Raises:
        StageFailed: a second pose, mirrored at the line of sight (Schweighofer and Pinz 2006), fits nearly as well.
    """
    found = [_refined(camera, view, pose) for pose in board_poses(camera, view.points_mm, view.pixels)]
    best, *others = sorted(found, key=lambda pose: float((pose.residuals_px**2).sum()))
    least = float((best.residuals_px**2).sum())
    variance = least / (2 * len(view.pixels) - 6)
    for other in others:
        turn = np.trace(best.camera_from_board.rotation.T @ other.camera_from_board.rotation)
        if turn < 3.0 - _SAME and float((other.residuals_px**2).sum()) - least < _ODDS * variance:
            raise StageFailed(
                f"{view.name}: two poses of the board explain what is seen; take it nearer or more from the side.",
                Status.AMBIGUOUS,
            )
    return best


_ODDS = 25.0
"""Less than this apart in squared standard deviations, two poses count as equally good."""

_SAME = 1e-4
"""Two poses are one where they are turned by less than 0.6° (trace of a rotation: 1 + 2 cos)."""


def board_poses(camera: Camera, points_mm: FloatArray, pixels: FloatArray) -> list[RigidTransform]:
    """One or two poses of a flat board in closed form (IPPE, Collins and Bartoli 2014), the better first.

    Args:
        camera: the camera.
        points_mm: of the board (n, 3), z = 0.
        pixels: where they are seen (n, 2).
    """
    slopes = undistorted(camera, pixels)
    middle = points_mm.mean(axis=0)
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        points_mm - middle, slopes.reshape(-1, 1, 2), np.eye(3), None, flags=cv2.SOLVEPNP_IPPE
    )
    poses = []
    for turn, shift in zip(turns, shifts, strict=True):
        rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)
        poses.append(RigidTransform("camera", "board", rotation, shift.ravel() - rotation @ middle))
    return poses


def _refined(camera: Camera, view: BoardView, start: RigidTransform) -> BoardPose:
    def equations(pose: RigidTransform) -> NormalEquations:
        pixels, jacobian = project_with_jacobian(camera, pose, view.points_mm)
        off = (pixels - view.pixels).ravel()
        by_pose = jacobian[:, :, :6].reshape(-1, 6)
        return NormalEquations(0.5 * float(off @ off), by_pose.T @ off, by_pose.T @ by_pose)

    found = minimum(start, equations, RigidTransform.moved)
    cofactor = inverse(found.equations.matrix)
    if cofactor is None:
        raise StageFailed(f"{view.name}: the points do not determine the board's pose.", Status.UNOBSERVABLE)
    pixels, jacobian = project_with_jacobian(camera, found.state, view.points_mm)
    by_pose, by_camera = jacobian[:, :, :6].reshape(-1, 6), jacobian[:, :, 6:].reshape(-1, 9)
    return BoardPose(found.state, cofactor, -cofactor @ by_pose.T @ by_camera, view.pixels - pixels)
