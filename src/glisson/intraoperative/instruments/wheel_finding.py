"""Finds a wheel in an image: an ellipse of white paper between black and ink."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.instruments import RINGS

_WINDOWS = (0.03, 0.09)
"""Sides of the neighbourhoods against which paper is bright, in image widths."""
_OVER = 6.0
"""Paper is brighter than the mean about it by so many grey levels."""
_LEAST_PX = 20
_LEAST_POINTS = 40
_TRIES = 100
_NEAR_PX = 1.2
_LEAST_ARC = 0.3
_FLATTEST = 0.6
"""Instruments lean by a few degrees only, so that wheels look round."""
_GOOD_SCORE, _SURE_SCORE = 0.4, 0.75
_ANGLES = 72


@dataclass(frozen=True, eq=False)
class FoundEllipse:
    """The outer edge of a wheel's white ring: middle (2,), half axes (2,) in px, and the first one's angle.

    `score` is the share of the wheel that looks as a wheel should.
    """

    middle: FloatArray
    half_axes: FloatArray
    angle: float
    score: float

    def points(self, scale: float = 1.0, count: int = _ANGLES) -> FloatArray:
        """Pixels (count, 2) around it, at so many times its size."""
        around = np.arange(count) * 2.0 * np.pi / count
        flat = scale * self.half_axes * np.stack([np.cos(around), np.sin(around)], axis=1)
        cosine, sine = np.cos(self.angle), np.sin(self.angle)
        turned: FloatArray = flat @ np.array([[cosine, sine], [-sine, cosine]]) + self.middle
        return turned


def find_wheel(paper: NDArray[np.float32]) -> FoundEllipse | None:
    """The best wheel in an image as `white_paper` has it; None where there is none."""
    rng = np.random.default_rng(0)
    best: FoundEllipse | None = None
    for outline in _outlines(paper):
        ellipse = _ellipse_of(outline, rng)
        if ellipse is None:
            continue
        # An outline is an edge of the outer white ring or of the inner one, of which more may be free.
        for share in (RINGS.white, RINGS.outer, RINGS.inner):
            middle, axes, angle = ellipse
            found = FoundEllipse(middle, axes * RINGS.white / share, angle, 0.0)
            score = _score(paper, found)
            if score > (best.score if best else _GOOD_SCORE):
                best = FoundEllipse(found.middle, found.half_axes, angle, score)
        if best is not None and best.score > _SURE_SCORE:
            break
    return best


def _outlines(paper: NDArray[np.float32]) -> Iterator[FloatArray]:
    """Outlines (n, 2) of all that is brighter than what is about it."""
    smooth = cv2.GaussianBlur(paper, (0, 0), 1.0)
    for share in _WINDOWS:
        side = 2 * int(0.5 * share * paper.shape[1]) + 1
        bright = (smooth > cv2.blur(smooth, (side, side)) + _OVER).astype(np.uint8)
        outlines, _ = cv2.findContours(bright, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
        for outline in outlines:
            points = outline[:, 0, :].astype(np.float64)
            if len(points) >= _LEAST_POINTS and np.ptp(points, axis=0).min() >= _LEAST_PX:
                yield points


def _ellipse_of(outline: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, FloatArray, float] | None:
    """The ellipse on which most of an outline lies, by random samples; None where too little does."""
    points = outline[:: max(1, len(outline) // 300)].astype(np.float32)
    best: NDArray[np.bool_] | None = None
    for _ in range(_TRIES):
        # Points of one stretch are on one arc more often than points from anywhere.
        begin, stretch = rng.integers(len(points)), max(12, int(len(points) * rng.uniform(0.1, 1.0)))
        chosen = (begin + rng.choice(stretch, 6, replace=False)) % len(points)
        near = _near(points, _fitted(points[chosen]))
        if near is not None and (best is None or near.sum() > best.sum()):
            best = near
    if best is None or best.sum() < 12:
        return None
    ellipse = _fitted(points[best])
    near = _near(points, ellipse)
    if ellipse is None or near is None:
        return None
    middle, sizes, turn = ellipse
    around = np.arctan2(*(points[near] - middle).T)
    if len(np.unique(np.floor(around * 18.0 / np.pi))) < _LEAST_ARC * 36:
        return None
    return np.array(middle), 0.5 * np.array(sizes), np.radians(turn)


_Ellipse = tuple[Sequence[float], Sequence[float], float]


def _fitted(points: NDArray[np.float32]) -> _Ellipse | None:
    """The ellipse nearest to points (n, 2), n ≥ 5; None where there is none, as on a line."""
    try:
        return cv2.fitEllipseDirect(points)
    except cv2.error:
        return None


def _near(points: NDArray[np.float32], ellipse: _Ellipse | None) -> NDArray[np.bool_] | None:
    """Which points (n,) lie on an ellipse; None where it cannot be a wheel's."""
    if ellipse is None:
        return None
    middle, sizes, turn = np.array(ellipse[0]), 0.5 * np.array(ellipse[1]), np.radians(ellipse[2])
    if not np.isfinite([*middle, *sizes]).all() or sizes.min() < 0.5 * _LEAST_PX * _FLATTEST:
        return None
    if sizes.min() < _FLATTEST * sizes.max():
        return None
    cosine, sine = np.cos(turn), np.sin(turn)
    flat = (points - middle) @ np.array([[cosine, -sine], [sine, cosine]]) / sizes
    near: NDArray[np.bool_] = np.abs(np.hypot(*flat.T) - 1.0) * sizes.mean() < _NEAR_PX
    return near


def _score(paper: NDArray[np.float32], ellipse: FoundEllipse) -> float:
    """Share of the directions in which black, white, ink and white follow each other from outside."""
    shares = np.array([0.5 * (1.0 + RINGS.white), 0.5 * (RINGS.white + RINGS.outer), 0.5 * (RINGS.outer + RINGS.inner),
                       0.5 * (RINGS.inner + RINGS.hole)])  # fmt: skip
    rings = []
    for share in shares / RINGS.white:
        places = ellipse.points(share).astype(np.float32)
        seen = cv2.remap(paper, places[:, 0], places[:, 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        rings.append(seen.ravel())
    black, white, ink, inner = rings
    typical = np.percentile(white, 70)
    good = (white > 0.6 * typical) & (black < 0.65 * white) & (ink < 0.75 * white) & (inner > ink)
    return float(good.mean()) if typical > 4.0 * _OVER else 0.0
