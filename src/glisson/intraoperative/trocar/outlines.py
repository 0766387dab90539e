"""Outlines of crosses in an image: coloured areas whose contour has the twelve corners of a cross."""

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.crosses import unit_corners
from glisson.geometry.compiled import compiled

_DARKEST = 30
"""Below this level of 255 the colour is lost in the noise."""

_COLOURFUL = 0.33
"""Share of its brightest channel that the darkest one of a colour lacks; inks lack 0.7, white under warm light 0.25."""

_SEAM = np.ones((5, 5), dtype=np.uint8)
"""Where red and green, or yellow and blue, blur into each other there is a seam of grey, px."""

_BORDER_PX = 3

_LEAST_AREA_PX = 150
_SOLIDITY = (0.58, 0.84)
"""Share of its convex hull that a cross fills: 5 / 7, whatever the direction of view."""

_FIT = 0.25
"""Corners may lie off those of a seen cross by this share of an arm's width (root mean square)."""


def cross_outlines(image: NDArray[np.uint8]) -> list[FloatArray]:
    """Corners (12, 2) in px of what has the outline of a cross, clockwise in the image from the end of any arm."""
    mask = cv2.morphologyEx(_coloured(np.ascontiguousarray(image)), cv2.MORPH_CLOSE, _SEAM)
    contours, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    found = []
    for contour in contours:
        area = cv2.contourArea(contour)
        if area < _LEAST_AREA_PX:
            continue
        solidity = area / max(cv2.contourArea(cv2.convexHull(contour)), 1.0)
        if _SOLIDITY[0] < solidity < _SOLIDITY[1]:
            corners = _twelve_corners(contour, area)
            if corners is not None and not _is_cut(corners, mask.shape):
                found.append(corners)
    return found


def _is_cut(corners: FloatArray, shape: tuple[int, ...]) -> bool:
    """Whether the image may end within the cross."""
    return bool(
        (corners < _BORDER_PX).any() or (corners > [shape[1] - 1 - _BORDER_PX, shape[0] - 1 - _BORDER_PX]).any()
    )


@compiled
def _coloured(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Mask [row, column] of what has a colour."""
    height, width = image.shape[:2]
    mask = np.zeros((height, width), dtype=np.uint8)
    for row in range(height):
        for column in range(width):
            red, green, blue = image[row, column, 0], image[row, column, 1], image[row, column, 2]
            most = max(red, green, blue)
            if most >= _DARKEST and most - min(red, green, blue) > _COLOURFUL * most:
                mask[row, column] = 1
    return mask


def _twelve_corners(contour: Any, area: float) -> FloatArray | None:
    """The corners of a contour; None where these are not twelve in the order of a cross."""
    arm = np.sqrt(area / 5.0)
    for tolerance in (0.2, 0.3, 0.14):
        corners = cv2.approxPolyDP(contour, tolerance * arm, True).reshape(-1, 2).astype(np.float64)
        if len(corners) == 12:
            return _in_order(corners, arm)
    return None


def _in_order(corners: FloatArray, arm: float) -> FloatArray | None:
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    turns = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    if turns.sum() < 0.0:
        corners, turns = corners[::-1], -turns[::-1]
    # v points down, so that a positive turn is clockwise: two outer corners, then an inner one.
    inner = np.flatnonzero(turns < 0.0)
    if len(inner) != 4 or (np.diff(inner) != 3).any():
        return None
    corners = np.roll(corners, -(int(inner[0]) + 1), axis=0)
    seen_from_cross, _ = cv2.findHomography(unit_corners(), corners)
    if seen_from_cross is None:
        return None
    fitted = cv2.perspectiveTransform(unit_corners()[None], seen_from_cross)[0]
    off = np.sqrt(np.mean(np.sum((fitted - corners) ** 2, axis=1)))
    return corners if off < _FIT * arm else None
