"""Finds what can be followed in a first frame: burnt spots, or corners."""

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status

BORDER_PX = 20
"""Markers nearer to the border could not be followed for long."""

_SCALES_PX = (4.0, 6.0, 9.0, 13.0)
"""Standard deviations of the spots that are looked for; a disc of radius r answers most to r / √2."""

_CONTRAST, _OF_BEST = 12.0, 0.4
"""Grey levels, at least, by which a spot is darker than its surroundings, and that as a share of the best spots'."""

_ROUND = 0.4
"""The smaller over the larger curvature of a spot; a vessel is a line and has less."""


def dark_spots(image: NDArray[np.uint8], most: int, least: int = 1) -> FloatArray:
    """The darkest round spots (m, 2) px (u, v) of a picture [row, column, red green blue], best first.

    Maxima over place and size of the scale-normalised Laplacian (Lindeberg 1998), which is a spot's contrast.

    Args:
        image: the picture.
        most: so many of them, if there are.
        least: so many there must be.

    Raises:
        BadInput: `most` is less than one.
        StageFailed: there are fewer than `least`.
    """
    _check_count(most)
    grey = grey_of(image).astype(np.float32)
    answers, roundness = zip(*(_response(grey, sigma) for sigma in _SCALES_PX), strict=True)
    best = np.max(answers, axis=0)
    size = np.argmax(answers, axis=0)
    around = cv2.dilate(best, np.ones((25, 25), dtype=np.uint8))
    round_enough = np.take_along_axis(np.array(roundness), size[None], axis=0)[0] > _ROUND
    rows, columns = np.nonzero((best == around) & (best > _CONTRAST) & round_enough & _inner(best.shape))
    order = np.argsort(-best[rows, columns])[:most]
    contrasts = best[rows, columns][order]
    if len(order):
        order = order[contrasts > _OF_BEST * np.median(contrasts[: (len(order) + 1) // 2])]
    _check_found(len(order), least, "dark spots")
    return np.column_stack([columns[order], rows[order]]).astype(np.float64)


def corners(image: NDArray[np.uint8], most: int, least: int = 1) -> FloatArray:
    """The best corners (m, 2) px (u, v) of a picture (Shi and Tomasi 1994), at least 20 px apart; as `dark_spots`."""
    _check_count(most)
    grey = grey_of(image)
    # Reflexes have the sharpest corners of all, and don't stay on the tissue.
    bright = cv2.dilate((grey > 230).astype(np.uint8), np.ones((31, 31), dtype=np.uint8))
    mask = (_inner(grey.shape) & (bright == 0)).astype(np.uint8)
    found = cv2.goodFeaturesToTrack(grey, most, 0.01, 20.0, mask=mask, blockSize=9)
    _check_found(0 if found is None else len(found), least, "corners")
    return np.asarray(found, dtype=np.float64).reshape(-1, 2)


def grey_of(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Grey levels of a picture [row, column, red green blue]."""
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)


def _check_count(count: int) -> None:
    if count < 1:
        raise BadInput(f"{count} markers cannot be looked for; ask for one or more.")


def _check_found(found: int, least: int, what: str) -> None:
    if found < least:
        raise StageFailed(
            f"Only {found} {what} were found in the first frame where {least} were asked for; ask for fewer, or give "
            "their places.",
            Status.UNOBSERVABLE,
        )


def _inner(shape: tuple[int, ...]) -> NDArray[np.bool_]:
    inner = np.zeros(shape, dtype=bool)
    inner[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX] = True
    return inner


def _response(grey: NDArray[np.float32], sigma: float) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """The scale-normalised Laplacian, as contrast of a disc of that size, and how round it is, at each pixel."""
    smooth = cv2.GaussianBlur(grey, (0, 0), sigma)
    xx = cv2.Sobel(smooth, cv2.CV_32F, 2, 0, ksize=3) / 4.0
    yy = cv2.Sobel(smooth, cv2.CV_32F, 0, 2, ksize=3) / 4.0
    xy = cv2.Sobel(smooth, cv2.CV_32F, 1, 1, ksize=3) / 4.0
    trace = xx + yy
    split = np.sqrt(np.maximum(0.25 * (xx - yy) ** 2 + xy**2, 0.0))
    small, large = 0.5 * trace - split, 0.5 * trace + split
    # A disc of contrast 1 and radius √2 σ answers with 2 / e.
    contrast = sigma**2 * trace * (np.e / 2.0)
    return contrast.astype(np.float32), np.where(large > 1e-6, small / np.maximum(large, 1e-6), 0.0)
