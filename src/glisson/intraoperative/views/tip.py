"""The tip of a tool in a picture: where a steel shaft that comes in over the picture's border ends."""

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status

_GREYEST = 38
"""Saturation of 255 up to which a colour is that of steel; tissue is far above."""

_DARKEST = 40
_LEAST_SHARE = 2e-3
_SLIMNESS = 2.5
"""A shaft is at least as many times as long as it is wide."""

_BORDER_PX = 4


def find_tip(image: NDArray[np.uint8]) -> FloatArray:
    """The pixel (2,) of a tool's tip in a picture (h, w, 3) red green blue.

    The shaft's two edges give its axis; the tip is where the shaft ends along that.

    Raises:
        StageFailed: no shaft comes in over the border, or several do.
    """
    shafts = [axis for mask in _candidates(image) if (axis := _tip_of(mask)) is not None]
    if len(shafts) != 1:
        found = "No tool's shaft" if not shafts else f"{len(shafts)} tools"
        raise StageFailed(
            f"{found} was recognised in the picture; give the tip's pixel (tip_px) by hand.", Status.AMBIGUOUS
        )
    return shafts[0]


def _candidates(image: NDArray[np.uint8]) -> list[NDArray[np.bool_]]:
    """Grey pieces that touch the border."""
    smooth = cv2.GaussianBlur(image, (0, 0), 2.0)
    colours = cv2.cvtColor(smooth, cv2.COLOR_RGB2HSV)
    grey = ((colours[..., 1] <= _GREYEST) & (colours[..., 2] >= _DARKEST)).astype(np.uint8)
    opened = cv2.morphologyEx(grey, cv2.MORPH_OPEN, np.ones((5, 5), np.uint8))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(opened)
    large = [row for row in range(1, count) if stats[row, cv2.CC_STAT_AREA] > _LEAST_SHARE * grey.size]
    return [labels == row for row in large]


def _tip_of(mask: NDArray[np.bool_]) -> FloatArray | None:
    """The end of a slim piece that lies inside the picture; None where the piece is no shaft."""
    down, across = np.nonzero(mask)
    places = np.column_stack([across, down]).astype(np.float64)
    middle = places.mean(axis=0)
    _, axes = np.linalg.eigh(np.cov((places - middle).T))
    along = (places - middle) @ axes[:, 1]
    if np.ptp(along) < _SLIMNESS * np.ptp((places - middle) @ axes[:, 0]):
        return None
    height, width = mask.shape
    edge = (across < _BORDER_PX) | (down < _BORDER_PX) | (across >= width - _BORDER_PX) | (down >= height - _BORDER_PX)
    if not edge.any():
        return None
    inward = -np.sign(along[edge].mean())
    if inward * along[edge].max() > 0.0 and inward * along[edge].min() < 0.0:
        return None  # it crosses the whole picture
    return _end(places, middle, inward * axes[:, 1])


def _end(places: FloatArray, middle: FloatArray, direction: FloatArray) -> FloatArray:
    """Where a piece ends along a direction, on the line midway between its two edges."""
    side = np.array([-direction[1], direction[0]])
    along, off = (places - middle) @ direction, (places - middle) @ side
    steps = np.rint(along).astype(np.int64)
    shift = steps - steps.min()
    count = np.bincount(shift)
    low, high = np.full(len(count), np.inf), np.full(len(count), -np.inf)
    np.minimum.at(low, shift, off)
    np.maximum.at(high, shift, off)
    whole = (count > 0) & (np.arange(len(count)) > 0.2 * len(count)) & (np.arange(len(count)) < 0.9 * len(count))
    slope, level = np.polyfit(np.flatnonzero(whole), 0.5 * (low + high)[whole], 1)
    last = float(along.max())
    tip: FloatArray = middle + last * direction + (slope * (last - steps.min()) + level) * side
    return tip
