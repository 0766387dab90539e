"""Which cross an outline is, by the colours of its five squares."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.crosses import CrossLayout, readings, unit_corners, unit_squares
from glisson.core.marker_colours import MARKER_COLOURS

HUES = np.array([[1.0, 0.0, 0.03], [1.0, 0.82, 0.0], [0.0, 1.0, 0.32], [0.0, 0.24, 1.0]])
"""What each colour is without its white part, the largest channel being 1."""

_NEAR, _CLEARLY = 0.45, 0.15
"""A colour is told where it is this near to its hue, and nearer than to any other by this."""

_UNTOLD = "?"
_NOTCHES = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]) / 3.0
"""White paper between the arms."""


@dataclass(frozen=True, eq=False)
class ReadCross:
    """A cross of the layout as it is seen: its number, and its corners (12, 2) in px in the order of `Cross`."""

    number: int
    corners_px: FloatArray


@dataclass(frozen=True, eq=False)
class Reading:
    """The crosses that were read, and how many were so as in a mirror, and of no cross in the layout."""

    crosses: tuple[ReadCross, ...]
    mirrored: int
    foreign: int


def read_crosses(image: NDArray[np.uint8], outlines: list[FloatArray], layout: CrossLayout) -> Reading:
    """Find the crosses of a layout among outlines; one colour of each may stay untold.

    Of a cross that is read twice none is taken.
    """
    codes = {code: (number, turn) for number, cross in enumerate(layout.crosses)
             for turn, code in enumerate(readings(cross.colours))}  # fmt: skip
    mirrors = {code for cross in layout.crosses for code in readings(cross.colours, mirrored=True)}
    found: list[ReadCross] = []
    mirrored = foreign = 0
    for outline in outlines:
        colours = _colours(image, outline)
        if colours is None:
            continue
        fits = [place for code, place in codes.items() if _is_same(colours, code)]
        if len(fits) == 1:
            number, turn = fits[0]
            # The outline begins at the arm that comes `turn` arms after the cross's right one.
            found.append(ReadCross(number, np.roll(outline, 3 * turn, axis=0)))
        elif any(_is_same(colours, code) for code in mirrors):
            mirrored += 1
        else:
            foreign += 1
    numbers = [one.number for one in found]
    return Reading(tuple(one for one in found if numbers.count(one.number) == 1), mirrored, foreign)


def _is_same(colours: tuple[str, ...], code: tuple[str, ...]) -> bool:
    return all(seen in (_UNTOLD, known) for seen, known in zip(colours, code, strict=True))


def _colours(image: NDArray[np.uint8], outline: FloatArray) -> tuple[str, ...] | None:
    """The colours of middle and arms, clockwise from the first one; None where more than one is untold, or no paper."""
    found, _ = cv2.findHomography(unit_corners(), outline)
    seen_from_cross = np.asarray(found, dtype=np.float64)
    paper = np.median(_levels(image, seen_from_cross, _NOTCHES), axis=0)
    squares = _levels(image, seen_from_cross, unit_squares())
    if not np.isfinite(paper).all() or not np.isfinite(squares).all() or paper.min() < 1.0:
        return None
    if (squares.min(axis=1) > 0.75 * paper.min()).any():
        return None
    told = tuple(colour_of(square, paper) for square in squares)
    return told if told.count(_UNTOLD) <= 1 else None


def colour_of(levels: FloatArray, paper: FloatArray) -> str:
    """Name of the colour with levels (3,) beside white paper's (3,); "?" where it is none of ours."""
    hue = levels / paper
    hue = hue - hue.min()
    if hue.max() < 0.08:
        return _UNTOLD
    off = np.linalg.norm(HUES - hue / hue.max(), axis=1)
    first, second = np.argsort(off)[:2]
    return MARKER_COLOURS[first] if off[first] < _NEAR and off[second] > off[first] + _CLEARLY else _UNTOLD


def _levels(image: NDArray[np.uint8], seen_from_cross: FloatArray, places: FloatArray) -> FloatArray:
    """Median colour (n, 3) about places (n, 2) of a cross of size 1; NaN outside the image."""
    steps = np.linspace(-0.07, 0.07, 5)
    spread = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    wanted = (places[:, None] + spread).reshape(1, -1, 2)
    pixels = np.rint(cv2.perspectiveTransform(wanted, seen_from_cross)[0]).astype(np.int64)
    height, width = image.shape[:2]
    inside = ((pixels >= 0) & (pixels < [width, height])).all(axis=1)
    values = np.full((len(pixels), 3), np.nan)
    values[inside] = image[pixels[inside, 1], pixels[inside, 0]]
    return np.asarray(np.median(values.reshape(len(places), -1, 3), axis=1))
