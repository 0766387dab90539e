"""Signed distances of level sets in 2-D and 3-D by fast sweeping (Zhao 2005, Math. Comp. 74:603).

Cells beside the zero level keep their sub-voxel distance (Russo and Smereka 2000, J. Comput. Phys.
163:51, equation 16), so that reinitialising a moving contour does not move it.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside


def signed_distance_of_mask(mask: NDArray[np.bool_], spacing_mm: FloatArray) -> FloatArray:
    """Distance in mm to the border of a mask, negative inside; any number of dimensions.

    The border is taken halfway between the voxels inside and outside.
    """
    outside = distance_inside(~mask, spacing_mm)
    inside = distance_inside(mask, spacing_mm)
    half = 0.5 * float(np.mean(spacing_mm))
    result: FloatArray = np.where(mask, half - inside, outside - half)
    return result


def reinitialised(phi: FloatArray, spacing_mm: FloatArray, width_mm: float = np.inf) -> FloatArray:
    """The signed distance in mm with the zero level of `phi`, up to ±`width_mm` (narrow band).

    Args:
        phi: level set, negative inside, shape (i, j, k); a 2-D one is a single layer i = 0.
        spacing_mm: voxel spacing (3,).
        width_mm: larger distances are not found and given as this width.
    """
    result: FloatArray = _reinitialised(phi, spacing_mm, min(width_mm, 1e9))
    return result


@njit(cache=True)
def _reinitialised(phi: FloatArray, spacing: FloatArray, width: float) -> FloatArray:
    ni, nj, nk = phi.shape
    distance = np.full(phi.shape, width)
    fixed = np.zeros(phi.shape, dtype=np.bool_)
    for i in range(ni):
        for j in range(nj):
            for k in range(nk):
                if _is_beside_border(phi, i, j, k):
                    distance[i, j, k] = abs(phi[i, j, k]) / max(_slope(phi, i, j, k, spacing), 1e-9)
                    fixed[i, j, k] = True
    # Twice in all directions: what an S-shaped contour's far side needs is found the second time.
    directions = 4 if ni == 1 else 8
    for sweep in range(2 * directions if width > 1e8 else directions):
        _sweep(distance, fixed, spacing, sweep & 1, (sweep >> 1) & 1, (sweep >> 2) & 1, width)
    return np.where(phi < 0.0, -distance, distance)


@njit(cache=True)
def _is_beside_border(phi: FloatArray, i: int, j: int, k: int) -> bool:
    """Whether one of the six neighbours has the other sign."""
    ni, nj, nk = phi.shape
    inside = phi[i, j, k] < 0.0
    beside: bool = (
        (i > 0 and (phi[i - 1, j, k] < 0.0) != inside)
        or (i < ni - 1 and (phi[i + 1, j, k] < 0.0) != inside)
        or (j > 0 and (phi[i, j - 1, k] < 0.0) != inside)
        or (j < nj - 1 and (phi[i, j + 1, k] < 0.0) != inside)
        or (k > 0 and (phi[i, j, k - 1] < 0.0) != inside)
        or (k < nk - 1 and (phi[i, j, k + 1] < 0.0) != inside)
    )
    return beside


@njit(cache=True)
def _slope(phi: FloatArray, i: int, j: int, k: int, spacing: FloatArray) -> float:
    """Size of the gradient; the steepest one-sided difference where that is larger."""
    here = phi[i, j, k]
    squared = 0.0
    largest = 0.0
    for axis in range(3):
        place = i if axis == 0 else (j if axis == 1 else k)
        low, high = here, here
        if place > 0:
            low = phi[i - (axis == 0), j - (axis == 1), k - (axis == 2)]
        if place < phi.shape[axis] - 1:
            high = phi[i + (axis == 0), j + (axis == 1), k + (axis == 2)]
        squared += ((high - low) / (2.0 * spacing[axis])) ** 2
        largest = max(largest, abs(high - here) / spacing[axis], abs(here - low) / spacing[axis])
    return float(max(np.sqrt(squared), largest))


@njit(cache=True)
def _sweep(
    distance: FloatArray,
    fixed: NDArray[np.bool_],
    spacing: FloatArray,
    back_k: int,
    back_j: int,
    back_i: int,
    width: float,
) -> None:
    """One Gauss–Seidel pass over the grid in one of the eight directions."""
    ni, nj, nk = distance.shape
    for a in range(ni):
        i = ni - 1 - a if back_i else a
        for b in range(nj):
            j = nj - 1 - b if back_j else b
            for c in range(nk):
                k = nk - 1 - c if back_k else c
                near_i = 1e9
                if ni > 1:
                    near_i = min(distance[max(i - 1, 0), j, k], distance[min(i + 1, ni - 1), j, k])
                near_j = min(distance[i, max(j - 1, 0), k], distance[i, min(j + 1, nj - 1), k])
                near_k = min(distance[i, j, max(k - 1, 0)], distance[i, j, min(k + 1, nk - 1)])
                if min(near_i, near_j, near_k) < width and not fixed[i, j, k]:
                    found = _eikonal(near_i, near_j, near_k, spacing)
                    distance[i, j, k] = min(distance[i, j, k], found)


@njit(cache=True)
def _eikonal(a: float, b: float, c: float, spacing: FloatArray) -> float:
    """Godunov's solution d of Σ max(d − near, 0)² / spacing² = 1 with the nearest values a, b, c along i, j, k."""
    wa, wb, wc = 1.0 / spacing[0] ** 2, 1.0 / spacing[1] ** 2, 1.0 / spacing[2] ** 2
    if b < a:
        a, b, wa, wb = b, a, wb, wa
    if c < b:
        b, c, wb, wc = c, b, wc, wb
        if b < a:
            a, b, wa, wb = b, a, wb, wa
    found = a + 1.0 / np.sqrt(wa)
    if found > b:
        weight, linear = wa + wb, wa * a + wb * b
        constant = wa * a * a + wb * b * b - 1.0
        found = (linear + np.sqrt(max(linear * linear - weight * constant, 0.0))) / weight
        if found > c:
            weight, linear = weight + wc, linear + wc * c
            constant += wc * c * c
            found = (linear + np.sqrt(max(linear * linear - weight * constant, 0.0))) / weight
    return float(found)
