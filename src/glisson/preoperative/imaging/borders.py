"""Where an organ reaches the border of the scan: it may go on beyond."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.image import Grid
from glisson.preoperative.imaging.axial import slice_axis


@dataclass(frozen=True)
class TouchedBorder:
    """One of the six border layers of the voxel array, and how much of the organ lies in it.

    `centre` is the mean voxel index (i, j, k) of that part.
    """

    axis: int
    is_first: bool
    voxels: int
    centre: tuple[float, float, float]

    @property
    def sentence(self) -> str:
        """For people."""
        side = "first" if self.is_first else "last"
        return (
            f"The organ touches the scan's {side} layer along axis {'ijk'[self.axis]} with {self.voxels} voxels; "
            "it is closed there and may go on beyond."
        )

    def slice_near(self, grid: Grid) -> int:
        """Number of the axial slice in the middle of the touching part."""
        return round(self.centre[slice_axis(grid)])


def touched_borders(mask: NDArray[np.bool_]) -> tuple[TouchedBorder, ...]:
    """The borders of the scan that a mask [i, j, k] reaches."""
    touched = []
    for axis in range(3):
        for is_first in (True, False):
            index = 0 if is_first else mask.shape[axis] - 1
            cells = np.argwhere(np.take(mask, index, axis=axis))
            if len(cells):
                i, j, k = np.insert(cells.mean(axis=0), axis, index)
                touched.append(TouchedBorder(axis, is_first, len(cells), (float(i), float(j), float(k))))
    return tuple(touched)
