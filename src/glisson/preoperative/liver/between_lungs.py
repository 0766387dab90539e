"""Where the heart lies: between the lungs, not far to the right of the body's middle.

The heart rests on the liver and often has its grey values. But to the left of all its voxels lies lung, and to the
right too; of the liver's this holds for the top of the left lobe only.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.image import Grid
from glisson.preoperative.imaging.working_grid import WorkingGrid

_AIR_HU = -250.0
_SMALLEST_LUNG_ML = 100.0
"""Stomach and bowel hold less gas in one place."""

_RIGHT_MM = 15.0
"""The heart goes about so far to the right of the body's middle, or farther."""


def between_lungs(smooth: NDArray[np.float32], working: WorkingGrid, scan: Grid) -> NDArray[np.bool_]:
    """Voxels with lung to both sides; none where the scan shows no lungs.

    Args:
        smooth: smoothed HU on the working grid (row, column, slice).
        working: the working grid.
        scan: that of the scan, which says where the patient's left is.
    """
    lungs = _lungs(smooth < _AIR_HU, float(np.prod(working.spacing_mm)) * 1e-3)
    leftward = scan.direction[0, list(working.order[:2])]
    axis = int(np.argmax(np.abs(leftward)))
    before = np.maximum.accumulate(lungs, axis=axis)
    after = np.flip(np.maximum.accumulate(np.flip(lungs, axis), axis=axis), axis)
    places = np.arange(smooth.shape[axis]) * working.spacing_mm[axis] * np.sign(leftward[axis])
    body = (smooth > _AIR_HU).sum(axis=tuple(a for a in range(3) if a != axis))
    order = np.argsort(places)
    middle = places[order][np.searchsorted(np.cumsum(body[order]), 0.5 * body.sum())]
    left = np.expand_dims(places > middle - _RIGHT_MM, [a for a in range(3) if a != axis])
    between: NDArray[np.bool_] = before & after & ~lungs & left
    return between


def _lungs(air: NDArray[np.bool_], voxel_ml: float) -> NDArray[np.bool_]:
    """Large parts of the air that do not reach the slices' edges, as the air about the patient does."""
    parts, _ = ndimage.label(air)
    sizes = np.bincount(parts.ravel()) * voxel_ml
    for edge in (parts[0], parts[-1], parts[:, 0], parts[:, -1]):
        sizes[np.unique(edge)] = 0.0
    sizes[0] = 0.0
    lungs: NDArray[np.bool_] = (sizes > _SMALLEST_LUNG_ML)[parts]
    return lungs
