"""Where brightness steps from a cross's ink to its paper, along lines across its edges."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.compiled import compiled
from glisson.intraoperative.trocar.reading import HUES

_STEP_PX = 0.5
_PLATEAU = 3
"""Samples at either end of a profile whose mean is the level there."""

_CONTRAST = 0.25
"""Share of the paper's level by which ink must be darker, the channels weighted by how much darker it is in them."""

_OVER_EXPOSED = 250.0

_WHITE = 0.40
"""Paper lacks at most this share of its brightest channel in the darkest one."""

_HUE_OFF = 0.55


@compiled
def edge_offsets(
    image: NDArray[np.uint8], pixels: FloatArray, normals: FloatArray, colours: IntArray, reach_px: float
) -> FloatArray:
    """Distances (n,) in px along the normals at which the edges lie; NaN where there is none of that colour.

    The edge is where all light of the profile would change at once: that does not depend on the blur (Tabatabai and
    Mitchell 1984).

    Args:
        image: [row, column, red green blue].
        pixels: where edges are expected (n, 2).
        normals: unit vectors (n, 2) from ink to paper.
        colours: numbers of the inks in `MARKER_COLOURS` (n,).
        reach_px: how far to look on either side.
    """
    count = int(2.0 * reach_px / _STEP_PX) + 1
    found = np.full(len(pixels), np.nan)
    profile, ink, paper, weights = np.zeros((count, 3)), np.zeros(3), np.zeros(3), np.zeros(3)
    height, width = image.shape[:2]
    for n in range(len(pixels)):
        u, v = pixels[n]
        if not (reach_px + 1.0 < u < width - reach_px - 2.0 and reach_px + 1.0 < v < height - reach_px - 2.0):
            continue
        for k in range(count):
            off = k * _STEP_PX - reach_px
            _bilinear(image, u + off * normals[n, 0], v + off * normals[n, 1], profile[k])
        for c in range(3):
            ink[c] = profile[:_PLATEAU, c].mean()
            paper[c] = profile[count - _PLATEAU :, c].mean()
            # Where the paper is over-exposed the edge is not where it seems.
            weights[c] = max(paper[c] - ink[c], 0.0) if paper[c] < _OVER_EXPOSED else 0.0
        if paper.min() < (1.0 - _WHITE) * paper.max() or not _is_ink(ink, paper, HUES[colours[n]]):
            continue
        low, high, bright = 0.0, 0.0, 0.0
        for c in range(3):
            low += weights[c] * ink[c]
            high += weights[c] * paper[c]
            bright += weights[c] * (profile[:, c].sum() - 0.5 * (profile[0, c] + profile[-1, c])) * _STEP_PX
        if high - low <= _CONTRAST * high:
            continue
        offset = reach_px - (bright - 2.0 * reach_px * low) / (high - low)
        if abs(offset) < reach_px - 1.5:
            found[n] = offset
    return found


@compiled
def _is_ink(ink: FloatArray, paper: FloatArray, hue: FloatArray) -> bool:
    """Whether a level (3,) beside that of paper has a hue."""
    own = ink / np.maximum(paper, 1.0)
    own = own - own.min()
    if own.max() < 0.08:
        return False
    return bool(np.sqrt(((own / own.max() - hue) ** 2).sum()) < _HUE_OFF)


@compiled
def _bilinear(image: NDArray[np.uint8], u: float, v: float, out: FloatArray) -> None:
    column, row = int(u), int(v)
    x, y = u - column, v - row
    for k in range(3):
        above = image[row, column, k] * (1.0 - x) + image[row, column + 1, k] * x
        below = image[row + 1, column, k] * (1.0 - x) + image[row + 1, column + 1, k] * x
        out[k] = above * (1.0 - y) + below * y
