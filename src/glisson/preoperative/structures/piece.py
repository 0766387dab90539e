"""The part of a mask about a click, cut off where the way on is narrow."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside


def piece_about(
    mask: NDArray[np.bool_], near: NDArray[np.bool_], spacing_mm: FloatArray, passage_mm: float
) -> NDArray[np.bool_]:
    """What of a mask [i, j, k] is reached from some voxels without a passage narrower than `passage_mm`.

    Opening by a ball, and the part of it that was clicked; where that is thinner itself, with a ball half as large, and
    so on. Holes are filled. Empty where no voxel of `near` is in the mask.
    """
    whole = _touched(mask, near)
    if not whole.any():
        return whole
    depth = distance_inside(whole, spacing_mm)
    radius = 0.5 * passage_mm
    while radius > 0.5 * float(spacing_mm.min()):
        core = _touched(depth > radius, near)
        if core.any():
            back: NDArray[np.bool_] = whole & (distance_inside(~core, spacing_mm) <= radius)
            return _filled(_touched(back | core, near))
        radius *= 0.5
    return _filled(whole)


def _touched(mask: NDArray[np.bool_], near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    numbered, _ = ndimage.label(mask)
    return np.isin(numbered, np.unique(numbered[near & mask]))


def _filled(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    filled: NDArray[np.bool_] = ndimage.binary_fill_holes(mask)
    return filled
