"""Which array axis of a grid runs from slice to slice, whatever way the scan is stored."""

import numpy as np

from glisson.core.image import Grid


def slice_axis(grid: Grid) -> int:
    """The array axis closest to the patient's long axis z: its indices number the axial slices."""
    return int(np.argmax(np.abs(grid.direction[2])))
