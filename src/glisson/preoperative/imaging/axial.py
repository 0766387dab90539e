"""Which array axis of a grid runs from slice to slice, whatever way the scan is stored."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.image import Grid


def slice_axis(grid: Grid) -> int:
    """The array axis closest to the patient's long axis z: its indices number the axial slices."""
    return int(np.argmax(np.abs(grid.direction[2])))


def slices_text(mask: NDArray[np.bool_], axis: int) -> str:
    """The slices along an axis that have a voxel of a mask, for people."""
    numbers = np.flatnonzero(np.moveaxis(mask, axis, 2).any(axis=(0, 1)))
    return f"slice {numbers[0]}" if len(numbers) == 1 else f"slices {numbers[0]} to {numbers[-1]}"
