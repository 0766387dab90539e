"""Focal lengths, principal point and distortion of a camera from views of a flat board."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.adjustment import inverse
from glisson.intraoperative.cameras.board_bundle import INTRINSIC, Bundle, Seen, adjusted_bundle
from glisson.intraoperative.cameras.board_pose import board_poses
from glisson.intraoperative.cameras.boards import BoardView
from glisson.intraoperative.cameras.calibration_checks import FOCAL_SHARE, check_repeated, notes_on_views, unobservable

DISTORTIONS: tuple[tuple[int, ...], ...] = ((), (0,), (0, 1), (0, 1, 2, 3), (0, 1, 2, 3, 4))
"""Sets of distortion terms that are tried, as indices of `NAMES`, each within the next."""

NAMES = ("k1", "k2", "p1", "p2", "k3")

_OUTLYING = 5.0
"""Standard deviations from which a point was not the board's: one in 250,000 is as far by chance."""

_LEAST_SIGMA_PX = 0.1
"""No point is left out for less than half a pixel."""

_FOCAL_LENGTHS = (0.2, 20.0)
"""Focal lengths of any camera, as a share of the image's width: 136° to 3° across."""

_MEDIAN_NORM = 1.1774
"""Median length of a vector of two normal deviates."""


@dataclass(frozen=True, eq=False)
class CameraCalibration:
    """A camera, and how well it explains the views.

    Args:
        camera: with its covariance; terms that were not estimated have none.
        camera_from_board: of each view, with covariance (that of the camera included).
        terms: distortion terms that the views support, of `NAMES`; the others are 0.
        residuals_px: found minus computed, (n, 2) of each view.
        used: which points (n,) of each view were used.
        sigma_px: standard deviation of each coordinate of a found point.
        rms_px: root mean square length of the residuals.
        rms_px_of_views: the same of each view.
        notes: sentences on what a person should look at.
    """

    camera: Camera
    camera_from_board: tuple[RigidTransform, ...]
    terms: tuple[str, ...]
    residuals_px: tuple[FloatArray, ...]
    used: tuple[NDArray[np.bool_], ...]
    sigma_px: float
    rms_px: float
    rms_px_of_views: tuple[float, ...]
    notes: tuple[str, ...]


def calibrate_camera(views: Sequence[BoardView], width: int, height: int) -> CameraCalibration:
    """Calibrate by Zhang's closed form (2000) and a bundle adjustment.

    Of the sets of distortion terms the one with the least information criterion of Akaike (1974) is kept.

    Args:
        views: three or more, of boards held at an angle.
        width: of the images, px.
        height: of the images, px.

    Raises:
        BadInput: fewer than three views, a point outside the image, or a view that repeats another one.
        StageFailed: unobservable, or a view that does not fit, with a sentence on what to change.
    """
    if len(views) < 3:
        raise BadInput(f"These are too few views to calibrate a camera ({len(views)}); take 10 or more, tilted.")
    _check_inside(views, width, height)
    check_repeated(views)
    seen = [Seen(view.points_mm, view.pixels, np.ones(len(view.pixels))) for view in views]
    best = _best_bundle(_start(seen, width, height), seen)
    used = _within(best.state.residuals(seen))
    if not all(one.all() for one in used):
        used = _within(_robust(best.state, seen).residuals(seen))
    for _ in range(5):
        if all(one.all() for one in used):
            break
        _check_enough(views, used)
        kept = [
            Seen(one.points_mm[keep], one.pixels[keep], one.weights[keep]) for one, keep in zip(seen, used, strict=True)
        ]
        best, before = _best_bundle(best.state, kept), used
        used = _within(best.state.residuals(seen))
        if all(np.array_equal(now, then) for now, then in zip(used, before, strict=True)):
            break
    return _told(best, views, seen, used)


def _start(seen: Sequence[Seen], width: int, height: int) -> Bundle:
    """Zhang's closed form with the principal point in the middle, and each board's pose for that focal length."""
    points = [view.points_mm.astype(np.float32) for view in seen]
    pixels = [view.pixels.astype(np.float32) for view in seen]
    focal = float(cv2.initCameraMatrix2D(points, pixels, (width, height), 1.0)[0, 0])
    if not np.isfinite(focal):
        focal = float(width)
    focal = float(np.clip(focal, *np.multiply(_FOCAL_LENGTHS, width)))
    camera = Camera(width, height, np.full(2, focal), np.array([width - 1, height - 1]) / 2.0)
    return Bundle(camera, tuple(board_poses(camera, one.points_mm, one.pixels)[0] for one in seen), ())


@dataclass(frozen=True, eq=False)
class _Adjusted:
    state: Bundle
    matrix: FloatArray
    sigma_px: float


def _best_bundle(start: Bundle, seen: Sequence[Seen]) -> _Adjusted:
    """Adjusted with the distortion terms that the views support."""
    count = 2 * sum(len(view.pixels) for view in seen)
    best: _Adjusted | None = None
    least = np.inf
    given = start.camera
    state = Bundle(Camera(given.width, given.height, given.focal_px, given.centre_px), start.poses, ())
    for terms in DISTORTIONS:
        found = adjusted_bundle(Bundle(state.camera, state.poses, terms), seen)
        state = found.state
        unknowns = len(found.equations.matrix)
        criterion = count * np.log(2.0 * found.equations.cost / count) + 2.0 * unknowns
        if criterion < least:
            variance = 2.0 * found.equations.cost / max(count - unknowns, 1)
            least, best = criterion, _Adjusted(state, found.equations.matrix, float(np.sqrt(variance)))
    assert best is not None  # the first criterion is finite
    return best


def _robust(bundle: Bundle, seen: Sequence[Seen]) -> Bundle:
    """The bundle to which points that fit badly hardly matter, by weights after Cauchy renewed ten times."""
    for _ in range(10):
        lengths = [np.linalg.norm(rows, axis=1) for rows in bundle.residuals(seen)]
        reach = 2.0 * _sigma(lengths)
        weighted = [
            Seen(one.points_mm, one.pixels, 1.0 / (1.0 + (own / reach) ** 2))
            for one, own in zip(seen, lengths, strict=True)
        ]
        bundle = adjusted_bundle(bundle, weighted).state
    return bundle


def _sigma(lengths: Sequence[FloatArray]) -> float:
    """Standard deviation of a coordinate from the lengths of residuals, by a median that outliers cannot spoil."""
    return max(float(np.median(np.concatenate(lengths))) / _MEDIAN_NORM, _LEAST_SIGMA_PX)


def _within(residuals: Sequence[FloatArray]) -> list[NDArray[np.bool_]]:
    """Which points are the board's."""
    lengths = [np.linalg.norm(rows, axis=1) for rows in residuals]
    return [one < _OUTLYING * _sigma(lengths) for one in lengths]


def _check_inside(views: Sequence[BoardView], width: int, height: int) -> None:
    for view in views:
        if (view.pixels < -0.5).any() or (view.pixels > [width - 0.5, height - 0.5]).any():
            raise BadInput(f"{view.name}: points of the board lie outside the image of {width} × {height} px.")


def _check_enough(views: Sequence[BoardView], kept: Sequence[NDArray[np.bool_]]) -> None:
    for view, keep in zip(views, kept, strict=True):
        if keep.sum() < max(6, 0.5 * len(keep)):
            raise StageFailed(
                f"{view.name}: only {keep.sum()} of {len(keep)} points fit the other views; leave this view out.",
                Status.STAGNATED,
            )


def _told(
    best: _Adjusted, views: Sequence[BoardView], seen: Sequence[Seen], used: Sequence[NDArray[np.bool_]]
) -> CameraCalibration:
    bundle = best.state
    free = bundle.free
    inverted = inverse(best.matrix)
    if inverted is None:
        raise unobservable(bundle.poses, np.inf)
    together = best.sigma_px**2 * inverted
    covariance = np.zeros((9, 9))
    covariance[np.ix_(free, free)] = together[: len(free), : len(free)]
    camera = Camera(
        bundle.camera.width, bundle.camera.height, bundle.camera.focal_px, bundle.camera.centre_px,
        bundle.camera.distortion, covariance,
    )  # fmt: skip
    share = float((np.sqrt(np.diag(covariance)[:2]) / camera.focal_px).max())
    low, high = np.multiply(_FOCAL_LENGTHS, camera.width)
    if share > FOCAL_SHARE or not low < camera.focal_px.min() <= camera.focal_px.max() < high:
        raise unobservable(bundle.poses, share)
    blocks = [slice(len(free) + 6 * number, len(free) + 6 * number + 6) for number in range(len(views))]
    residuals = bundle.residuals(seen)
    squares = [(rows[keep] ** 2).sum(axis=1) for rows, keep in zip(residuals, used, strict=True)]
    return CameraCalibration(
        camera,
        tuple(replace(p, covariance=together[block, block]) for p, block in zip(bundle.poses, blocks, strict=True)),
        tuple(NAMES[index - INTRINSIC] for index in free if index >= INTRINSIC),
        tuple(residuals),
        tuple(used),
        best.sigma_px,
        float(np.sqrt(np.concatenate(squares).mean())),
        tuple(float(np.sqrt(one.mean())) for one in squares),
        notes_on_views(camera, views, bundle.poses, used, [float(np.sqrt(one.mean())) for one in squares]),
    )
