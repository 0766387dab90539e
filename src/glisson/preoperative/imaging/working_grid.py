"""A scan brought to a resolution and axis order in which segmentation is quick, and masks brought back."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.image import Grid
from glisson.preoperative.imaging.axial import slice_axis


@dataclass(frozen=True, eq=False)
class WorkingGrid:
    """How working voxels (row, column, slice) come from a scan's voxels [i, j, k].

    The slices' axis comes last (`order` permutes the scan's axes) and blocks of `factors` voxels are
    averaged. `spacing_mm` is that of the working voxels.
    """

    order: tuple[int, int, int]
    factors: tuple[int, int, int]
    shape: tuple[int, int, int]
    spacing_mm: FloatArray

    @classmethod
    def of(cls, grid: Grid, resolution_mm: float) -> "WorkingGrid":
        """The working grid of a scan, of about that resolution or the scan's own where that is coarser."""
        axis = slice_axis(grid)
        first, second = (a for a in range(3) if a != axis)
        order = (first, second, axis)
        spacing = grid.spacing_mm[list(order)]
        factors = np.maximum(np.rint(resolution_mm / spacing), 1).astype(int)
        a, b, c = (grid.shape[n] for n in order)
        return cls(order, (int(factors[0]), int(factors[1]), int(factors[2])), (a, b, c), spacing * factors)

    def working(self, voxels: NDArray[np.generic]) -> NDArray[np.float32]:
        """Voxels [i, j, k] averaged to the working grid; the last, incomplete blocks repeat their edge."""
        turned = np.transpose(voxels, self.order)
        padding = [(0, -count % factor) for count, factor in zip(turned.shape, self.factors, strict=True)]
        padded = np.pad(turned, padding, mode="edge").astype(np.float32)
        (a, b, c), (fa, fb, fc) = padded.shape, self.factors
        blocks = padded.reshape(a // fa, fa, b // fb, fb, c // fc, fc)
        result: NDArray[np.float32] = blocks.mean(axis=(1, 3, 5), dtype=np.float32)
        return result

    def working_index(self, indices: FloatArray) -> tuple[int, int, int]:
        """The working voxel that holds a point given by the scan's fractional indices (3,)."""
        turned = (np.asarray(indices)[list(self.order)] + 0.5) / self.factors
        last = -(-np.array(self.shape) // self.factors) - 1
        a, b, c = np.clip(np.floor(turned), 0, last).astype(int)
        return int(a), int(b), int(c)

    def slices(self, working_slice: int) -> range:
        """The scan's slice numbers that a working slice stands for."""
        factor = self.factors[2]
        return range(working_slice * factor, min((working_slice + 1) * factor, self.shape[2]))

    def part(self, low: Sequence[int], high: Sequence[int]) -> tuple["WorkingGrid", tuple[slice, ...]]:
        """The grid of working voxels from `low` (3,) to before `high` (3,), and its place in the scan [i, j, k]."""
        first = np.array(low) * self.factors
        last = np.minimum(np.array(high) * self.factors, self.shape)
        a, b, c = (last - first).tolist()
        turned = [slice(int(x), int(y)) for x, y in zip(first, last, strict=True)]
        place = tuple(turned[axis] for axis in np.argsort(self.order))
        return WorkingGrid(self.order, self.factors, (a, b, c), self.spacing_mm), place

    def full(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """A working mask on the scan's grid [i, j, k], its border interpolated linearly."""
        smooth = ndimage.zoom(
            ndimage.gaussian_filter(mask.astype(np.float32), 0.5), self.factors, order=1, grid_mode=True, mode="nearest"
        )
        a, b, c = self.shape
        inside: NDArray[np.bool_] = np.transpose(smooth[:a, :b, :c] >= 0.5, np.argsort(self.order))
        return inside
