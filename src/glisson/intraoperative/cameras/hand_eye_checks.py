"""Whether tracked poses belong to the images of a board, and which of them do not."""

from collections.abc import Sequence

import numpy as np
from scipy.stats import t as student

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.board_pose import BoardPose
from glisson.intraoperative.cameras.hand_eye_closed_form import hand_eye_closed_form
from glisson.intraoperative.cameras.hand_eye_equations import HandEyeView, tracked
from glisson.intraoperative.cameras.turning import turning

_TURNED_DEG = 3.0
_TRACKER_DEG, _TRACKER_MM, _TOGETHER = 1.5, 4.0, 0.02
"""No tracker errs more (standard deviations); nor do the points of a board together, as a part of the image's width."""
_FIT_MM = 10.0
_LESS, _MORE = 0.85, 1.08
"""Between these the board's motion is as large as the tracker's: errors of tracked turns make it seem smaller."""


def check_views(views: Sequence[HandEyeView]) -> None:
    """Refuse views that cannot tell hand and eye.

    Raises:
        BadInput: fewer than three views, or a second marker in some only.
        StageFailed: unobservable (poses nearly parallel).
    """
    if len(views) < 3:
        raise BadInput(f"These are too few views for a hand–eye calibration ({len(views)}); take 10 or more.")
    if len({view.room_from_base is None for view in views}) > 1:
        raise BadInput("The board's marker was tracked in some views only; give its poses for all of them or for none.")
    turned = turning([tracked(view).rotation.T for view in views])
    if turned.about_second_deg < _TURNED_DEG:
        raise StageFailed(
            "The poses are nearly parallel: turn the scope about another axis "
            f"(it was turned by {turned.about_first_deg:.1f}° about one and {turned.about_second_deg:.1f}° about the "
            "next).",
            Status.UNOBSERVABLE,
        )


def check_fit(
    views: Sequence[HandEyeView], boards: Sequence[BoardPose], width: int, sizes: tuple[float, float, float]
) -> None:
    """Refuse poses that do not belong to the images, however well the rest was computed.

    Args:
        views: the views.
        boards: the board as seen in each view.
        width: of the images in px.
        sizes: standard deviations that the residuals show: the board's points together in px, a tracked angle in
            degrees, a tracked coordinate in mm.

    Raises:
        StageFailed: stagnated; the sentence names the views that do not fit the others, or the scale.
    """
    fits = all(
        size < most for size, most in zip(sizes, (_TOGETHER * width, _TRACKER_DEG, _TRACKER_MM), strict=True)
    )  # fmt: skip
    odd = [] if fits else _odd_views(views, boards)
    if odd:
        names = " and ".join(views[number].board.name for number in odd)
        raise StageFailed(
            f"{names} {'does' if len(odd) == 1 else 'do'} not fit the other views: are images and poses in the same "
            "order and of the same moments, and was everything at rest?",
            Status.STAGNATED,
        )
    scale = _seen_to_tracked(views, boards)
    if scale is not None:
        raise StageFailed(
            f"The board moves {scale:.3g} times as far in the images as the tracker says: look at the size of its "
            "squares and at the units of the poses (mm).",
            Status.STAGNATED,
        )
    if not fits:
        raise StageFailed(
            f"The poses do not fit the images (the tracker would err by {sizes[2]:.1f} mm and {sizes[1]:.1f}°, the "
            f"board's points together by {sizes[0]:.0f} px): look at their order, direction and units, at the size of "
            "the squares, and whether the board moved.",
            Status.STAGNATED,
        )


def _odd_views(views: Sequence[HandEyeView], boards: Sequence[BoardPose]) -> list[int]:
    """The few views, counted from 0, without which the others fit each other; none if there are no such."""
    left = list(range(len(views)))
    for _ in range(len(views) // 5 if len(views) > 5 else 0):
        tried = [[number for number in left if number != out] for out in left]
        apart = [_apart_mm([views[n] for n in rest], [boards[n] for n in rest]) for rest in tried]
        left = tried[int(np.argmin(apart))]
        if min(apart) < _FIT_MM:
            return sorted(set(range(len(views))) - set(left))
    return []


def _apart_mm(views: Sequence[HandEyeView], boards: Sequence[BoardPose]) -> float:
    """Root mean square distance between board points as seen and as tracked, by the closed form."""
    x, z = hand_eye_closed_form([board.camera_from_board for board in boards], [tracked(view) for view in views])
    off = [
        board.camera_from_board.apply(view.board.points_mm)
        - x.after(tracked(view)).after(z).apply(view.board.points_mm)
        for view, board in zip(views, boards, strict=True)
    ]
    return float(np.sqrt(np.mean([(rows**2).sum(axis=1).mean() for rows in off])))


def _seen_to_tracked(views: Sequence[HandEyeView], boards: Sequence[BoardPose]) -> float | None:
    """How many times as far as tracked the board moves in the images; None where that may well be once.

    The linear equations of the translations in `hand_eye_closed_form` have this factor as one more unknown.
    """
    poses: list[RigidTransform] = [tracked(view) for view in views]
    x, _ = hand_eye_closed_form([board.camera_from_board for board in boards], poses)
    rows = np.concatenate(
        [np.column_stack([np.eye(3), x.rotation @ pose.rotation, x.rotation @ pose.translation_mm]) for pose in poses]
    )
    right: FloatArray = np.concatenate([board.camera_from_board.translation_mm for board in boards])
    found = np.linalg.lstsq(rows, right, rcond=None)[0]
    spare = len(right) - 7
    sigma = float(np.sqrt(((rows @ found - right) ** 2).sum() / spare * np.linalg.pinv(rows.T @ rows)[6, 6]))
    scale = float(found[6])
    unlike = abs(scale - 1.0) > sigma * student.isf(5e-6, spare) and scale > 10.0 * sigma
    return scale if unlike and not _LESS < scale < _MORE else None
