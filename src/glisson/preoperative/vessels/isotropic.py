"""The box of a scan that holds an organ, resampled to cubic voxels, in which vessels look alike in all directions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.errors import BadInput
from glisson.core.image import Grid

_MARGIN_MM = 5.0


@dataclass(frozen=True)
class IsotropicBox:
    """A block of voxels [i, j, k] of a scan (`low` to before `high`) and its shape in cubic voxels of `size_mm`."""

    low: tuple[int, int, int]
    high: tuple[int, int, int]
    scan_shape: tuple[int, int, int]
    shape: tuple[int, int, int]
    size_mm: float

    @classmethod
    def around(cls, mask: NDArray[np.bool_], grid: Grid, size_mm: float) -> "IsotropicBox":
        """The box of a mask and some millimetres about it.

        Raises:
            BadInput: the mask is empty.
        """
        boxes = ndimage.find_objects(mask.astype(np.uint8))
        if not boxes:
            raise BadInput("The organ's mask is empty; segment the liver first.")
        margin = np.ceil(_MARGIN_MM / grid.spacing_mm).astype(int)
        low = np.maximum([side.start for side in boxes[0]] - margin, 0)
        high = np.minimum([side.stop for side in boxes[0]] + margin, grid.shape)
        shape = np.maximum(np.rint((high - low) * grid.spacing_mm / size_mm), 1).astype(int)
        return cls(_three(low), _three(high), grid.shape, _three(shape), size_mm)

    def values(self, voxels: NDArray[np.generic]) -> NDArray[np.float32]:
        """Grey values of the scan in cubic voxels; what is finer than these is averaged."""
        block = voxels[self._slices].astype(np.float32)
        ratios = np.array(block.shape) / self.shape
        softened = ndimage.gaussian_filter(block, np.where(ratios > 1.0, 0.5 * ratios, 0.0))
        return _resampled(softened, self.shape)

    def mask(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """A mask of the scan in cubic voxels."""
        inside: NDArray[np.bool_] = _resampled(mask[self._slices].astype(np.float32), self.shape) >= 0.5
        return inside

    def back(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """A mask in cubic voxels on the scan's grid."""
        whole = np.zeros(self.scan_shape, dtype=bool)
        block = whole[self._slices]
        block[:] = _resampled(mask.astype(np.float32), _three(block.shape)) >= 0.5
        return whole

    @property
    def _slices(self) -> tuple[slice, slice, slice]:
        (a, b, c), (d, e, f) = self.low, self.high
        return slice(a, d), slice(b, e), slice(c, f)


def _resampled(values: NDArray[np.float32], shape: tuple[int, int, int]) -> NDArray[np.float32]:
    """Linear interpolation at the centres of another number of voxels in the same box."""
    ratios = np.array(values.shape) / np.array(shape)
    result: NDArray[np.float32] = ndimage.affine_transform(
        values, ratios, offset=0.5 * ratios - 0.5, output_shape=shape, order=1, mode="nearest"
    )
    return result


def _three(numbers: object) -> tuple[int, int, int]:
    a, b, c = np.asarray(numbers).tolist()
    return int(a), int(b), int(c)
