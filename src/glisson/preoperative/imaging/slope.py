"""How steep grey values are."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray


def slope(values: NDArray[np.float32], spacing_mm: FloatArray) -> NDArray[np.float32]:
    """Length of the gradient of grey values (a, b, c) in voxels of a spacing (3,), per mm."""
    squares = sum((step / size) ** 2 for step, size in zip(np.gradient(values), spacing_mm, strict=True))
    steepness: NDArray[np.float32] = np.sqrt(squares).astype(np.float32)
    return steepness
