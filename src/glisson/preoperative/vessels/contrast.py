"""Grey values against the tissue around: what a vessel is brighter, or a duct darker, than the organ beside it."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

_AROUND_MM = 15.0
_CLIPPED = 60.0
"""Grey values farther from the organ's median are not its tissue and tell nothing of it."""


def excess(values: NDArray[np.float32], organ: NDArray[np.bool_], size_mm: float) -> NDArray[np.float32]:
    """Grey values [i, j, k] less the organ's own near by (a Gaussian mean inside it), zero outside the organ."""
    middle = float(np.median(values[organ]))
    tissue = organ & (np.abs(values - middle) < _CLIPPED)
    weights = ndimage.gaussian_filter(tissue.astype(np.float32), _AROUND_MM / size_mm, truncate=3.0)
    means = ndimage.gaussian_filter(np.where(tissue, values - middle, 0.0), _AROUND_MM / size_mm, truncate=3.0)
    near: NDArray[np.float32] = means / np.maximum(weights, 1e-3)
    result: NDArray[np.float32] = np.where(organ, values - middle - near, 0.0).astype(np.float32)
    return result


def without_crumbs(mask: NDArray[np.bool_], smallest_mm3: float, size_mm: float) -> NDArray[np.bool_]:
    """The parts of a mask (touching by corners, too) that are not smaller than this."""
    numbered, _ = ndimage.label(mask, structure=np.ones((3, 3, 3)))
    sizes = np.bincount(numbered.ravel()) * size_mm**3
    sizes[0] = 0.0
    kept: NDArray[np.bool_] = sizes[numbered] >= smallest_mm3
    return kept
