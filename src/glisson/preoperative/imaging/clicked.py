"""Places that a person clicked in a scan."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Grid
from glisson.core.units import place_text
from glisson.preoperative.imaging.surroundings import Index, surroundings


def checked_clicks(grid: Grid, points_mm: FloatArray) -> FloatArray:
    """The fractional voxel indices (n, 3) of clicks (n, 3), LPS mm.

    Raises:
        BadInput: a click lies outside the scan.
    """
    indices = grid.indices_from_points(points_mm)
    outside = ((indices < -0.5) | (indices > np.array(grid.shape) - 0.5)).any(axis=1)
    if outside.any():
        raise BadInput(f"The click {place_text(points_mm[outside][0])} lies outside the scan, which {_extent(grid)}.")
    return indices


def block_about_click(grid: Grid, point_mm: FloatArray, reach_mm: float) -> tuple[tuple[slice, ...], Index]:
    """The part of the scan within so many mm of a click (3,), LPS mm, along each axis, and the clicked voxel in it.

    Raises:
        BadInput: the click lies outside the scan.
    """
    index = np.rint(checked_clicks(grid, point_mm[None])[0]).astype(int)
    a, b, c = np.clip(index, 0, np.array(grid.shape) - 1).tolist()
    return surroundings(grid.shape, grid.spacing_mm, (a, b, c), reach_mm)


def _extent(grid: Grid) -> str:
    corners = grid.points_from_indices(np.array([(0, 0, 0), grid.shape]) - [[0], [1]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    ranges = ", ".join(f"{axis} {a:.0f} to {b:.0f}" for axis, a, b in zip("xyz", low, high, strict=True))
    return f"has {ranges} mm (LPS)"
