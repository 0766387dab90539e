"""Edge-preserving smoothing by anisotropic diffusion (Perona and Malik 1990, IEEE PAMI 12:629)."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray

_EDGE_HU = 20.0
_STEPS = 6


def diffused(voxels: NDArray[np.floating], spacing_mm: FloatArray, edge: float, iterations: int) -> NDArray[np.float32]:
    """Voxels [i, j, k] after some steps of ∂I/∂t = div(g ∇I), g = 1 / (1 + (ΔI / edge)²).

    Args:
        voxels: grey values.
        spacing_mm: voxel spacing (3,); neighbours further away count less.
        edge: difference of neighbouring grey values at which half as much flows.
        iterations: steps; each one smooths over about half of the smallest spacing.
    """
    weights = (float(np.min(spacing_mm)) / np.asarray(spacing_mm, dtype=np.float64)) ** 2
    step = 0.9 / (2.0 * float(weights.sum()))
    result: NDArray[np.float32] = _diffused(voxels.astype(np.float32), step * weights, edge, iterations)
    return result


def smoothed(hu: NDArray[np.floating], spacing_mm: FloatArray) -> NDArray[np.float32]:
    """Voxels [i, j, k] on the scale of HU as segmentation looks at them: without noise, with their edges."""
    return diffused(hu, spacing_mm, _EDGE_HU, _STEPS)


@njit(cache=True)
def _diffused(values: NDArray[np.float32], rates: FloatArray, edge: float, iterations: int) -> NDArray[np.float32]:
    ni, nj, nk = values.shape
    squared = np.float32(1.0 / (edge * edge))
    ri, rj, rk = np.float32(rates[0]), np.float32(rates[1]), np.float32(rates[2])
    one = np.float32(1.0)
    other = values.copy()
    for _ in range(iterations):
        for i in range(ni):
            for j in range(nj):
                for k in range(nk):
                    here = values[i, j, k]
                    d = values[max(i - 1, 0), j, k] - here
                    flow = ri * d / (one + squared * d * d)
                    d = values[min(i + 1, ni - 1), j, k] - here
                    flow += ri * d / (one + squared * d * d)
                    d = values[i, max(j - 1, 0), k] - here
                    flow += rj * d / (one + squared * d * d)
                    d = values[i, min(j + 1, nj - 1), k] - here
                    flow += rj * d / (one + squared * d * d)
                    d = values[i, j, max(k - 1, 0)] - here
                    flow += rk * d / (one + squared * d * d)
                    d = values[i, j, min(k + 1, nk - 1)] - here
                    flow += rk * d / (one + squared * d * d)
                    other[i, j, k] = here + flow
        values, other = other, values
    return values
