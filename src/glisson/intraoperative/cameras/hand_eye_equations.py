"""What tracked views of a board say of the hand–eye pose and of the board's place: A = X B Z, linearised."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.transform import RigidTransform, cross_matrix
from glisson.intraoperative.cameras.board_pose import BoardPose
from glisson.intraoperative.cameras.boards import BoardView
from glisson.intraoperative.cameras.variance_components import Blocks

_IN_ANGLE = np.diag([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
_IN_PLACE = np.diag([0.0, 0.0, 0.0, 1.0, 1.0, 1.0])


@dataclass(frozen=True, eq=False)
class HandEyeView:
    """One image of the board, and what the tracker saw at the same time.

    Args:
        board: where the board's points are in the image.
        room_from_marker: pose of the marker on the camera.
        room_from_base: pose of a second marker, fixed to the board; None where the board rests in the room.
    """

    board: BoardView
    room_from_marker: RigidTransform
    room_from_base: RigidTransform | None = None


def tracked(view: HandEyeView, tracker: FloatArray | None = None) -> RigidTransform:
    """`marker_from_base` of a view; `tracker` is the covariance (6, 6) of each tracked pose."""
    own = view.room_from_marker
    marker_from_room = RigidTransform("room", "marker", own.rotation, own.translation_mm, tracker).inverse()
    if view.room_from_base is None:
        room_from_base = RigidTransform("room", "base", np.eye(3), np.zeros(3))
    else:
        other = view.room_from_base
        room_from_base = RigidTransform("room", "base", other.rotation, other.translation_mm, tracker)
    return marker_from_room.after(room_from_base)


def linearised(
    poses: tuple[RigidTransform, RigidTransform],
    boards: Sequence[BoardPose],
    views: Sequence[HandEyeView],
    sigma_px: float,
    camera_steps: FloatArray,
) -> Blocks:
    """How far each board, as seen, is from where it is tracked, by steps of X (6), Z (6) and the camera (k).

    Args:
        poses: `camera_from_marker` X and `base_from_board` Z.
        boards: the board as seen in each view.
        views: the views.
        sigma_px: standard deviation of a coordinate of a found point.
        camera_steps: steps (9, k) of the camera's intrinsics, each of one standard deviation.

    Returns:
        Blocks of turn and shift (n, 6); the parts are the tracker's errors in angle (1 rad) and in place (1 mm), and an
        error that the points of a board share, as if each were found to 1 px only.
    """
    camera_from_marker, base_from_board = (replace(pose, covariance=np.zeros((6, 6))) for pose in poses)
    residuals, jacobians, parts = [], [], []
    for board, view in zip(boards, views, strict=True):
        through = [
            camera_from_marker.after(tracked(view, kind)).after(base_from_board) for kind in (_IN_ANGLE, _IN_PLACE)
        ]
        parts.append([*(pose.covariance for pose in through), board.cofactor])
        residuals.append(_step(through[0], board.camera_from_board))
        arm = through[0].translation_mm - camera_from_marker.translation_mm
        by_first = np.block([[np.eye(3), np.zeros((3, 3))], [-cross_matrix(arm), np.eye(3)]])
        by_last = np.kron(np.eye(2), camera_from_marker.rotation @ tracked(view).rotation)
        jacobians.append(np.hstack([by_first, by_last, -board.by_camera @ camera_steps]))
    known = sigma_px**2 * np.stack([board.cofactor for board in boards])
    prior = np.diag(np.concatenate([np.zeros(12), np.ones(camera_steps.shape[1])]))
    return Blocks(np.stack(residuals), np.stack(jacobians), known, np.array(parts).transpose(1, 0, 2, 3), prior)


def camera_steps(camera: Camera) -> FloatArray:
    """Independent steps (9, k) of a camera's intrinsics of one standard deviation each; none where it is exact."""
    if camera.covariance is None:
        return np.zeros((9, 0))
    scale = np.sqrt(np.maximum(np.diag(camera.covariance), 1e-300))
    values, vectors = np.linalg.eigh(camera.covariance / np.outer(scale, scale))
    kept = values > 1e-9
    steps: FloatArray = scale[:, None] * vectors[:, kept] * np.sqrt(values[kept])
    return steps


def moved_camera(camera: Camera, step: FloatArray) -> Camera:
    """A camera with its intrinsics moved by a step (9,), without covariance."""
    return Camera(
        camera.width, camera.height, camera.focal_px + step[:2], camera.centre_px + step[2:4],
        camera.distortion + step[4:],
    )  # fmt: skip


def _step(start: RigidTransform, end: RigidTransform) -> FloatArray:
    """The d and e (6,) of `RigidTransform` that take one pose to another."""
    turn = Rotation.from_matrix(end.rotation @ start.rotation.T).as_rotvec()
    return np.concatenate([turn, end.translation_mm - start.translation_mm])
