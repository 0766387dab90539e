"""Ridges that go on along a line: how far a tube of some radius stands out from noise.

The second derivatives of a Gaussian elongated along the tube (Lopez-Molina et al. 2015, Signal Processing 116:55): the
Hessian of a round Gaussian, averaged along a line in each of 49 directions. Across the line, the weaker of the two
curvatures counts (Sato et al. 1998, Medical Image Analysis 2:143), so that plates and edges are no tubes. Averaging
along a thin vessel keeps its response and takes noise away, which is what hides it.
"""

import itertools
import math

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray, IntArray

_MAD_OF_NORMAL = 1.4826
_DERIVATIVES = ((2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1))


def ridge_strength(
    values: NDArray[np.float32], within: NDArray[np.bool_], radii: FloatArray, length: float
) -> NDArray[np.float32]:
    """How much each voxel [i, j, k] looks like the middle of a bright tube, in standard deviations of this.

    Each radius is measured by its own spread in the organ (from the median of absolute deviations), most of which is
    no tube; the largest of the radii counts.

    Args:
        values: grey values in cubic voxels.
        within: the organ, not empty; outside the result is zero.
        radii: standard deviations of the Gaussian across, voxels.
        length: standard deviation of the Gaussian along, voxels.
    """
    directions = _directions()
    offsets, weights = _lines(directions, length)
    across = np.stack([_across(direction) for direction in directions]).astype(np.float32)
    cells = np.argwhere(within)
    strongest = np.full(len(cells), -np.inf, dtype=np.float32)
    for radius in radii:
        found = _ridges(_hessian(values, float(radius)), cells, offsets, weights, across)
        middle = np.median(found)
        spread = _MAD_OF_NORMAL * np.median(np.abs(found - middle))
        np.maximum(strongest, (found - middle) / max(float(spread), 1e-6), out=strongest)
    result = np.zeros(values.shape, dtype=np.float32)
    result[within] = strongest
    return result


def _directions() -> FloatArray:
    """Unit vectors (49, 3) to the voxels up to two steps away, one for each line through them."""
    steps = [step for step in itertools.product(range(-2, 3), repeat=3) if step > (0, 0, 0) and math.gcd(*step) == 1]
    vectors = np.array(steps, dtype=np.float64)
    vectors /= np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors


def _lines(directions: FloatArray, length: float) -> tuple[IntArray, NDArray[np.float32]]:
    """Offsets (n, m, 3) of the voxels along each direction, and their weights (m,)."""
    reach = math.ceil(2.0 * length)
    along = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 * np.square(along / length))
    offsets = np.rint(directions[:, None, :] * along[None, :, None]).astype(np.int64)
    return offsets, (weights / weights.sum()).astype(np.float32)


def _across(direction: FloatArray) -> FloatArray:
    """Two unit vectors (2, 3) at right angles to a direction and to each other."""
    first = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(direction, first)])


def _hessian(values: NDArray[np.float32], radius: float) -> NDArray[np.float32]:
    """Second derivatives xx, yy, zz, xy, xz, yz at this scale, normalised to it, [i, j, k, 6]."""
    made = np.empty((*values.shape, 6), dtype=np.float32)
    for n, order in enumerate(_DERIVATIVES):
        made[..., n] = ndimage.gaussian_filter(values, radius, order=order, truncate=3.0)
    made *= radius**2
    return made


@njit(cache=True, parallel=True)
def _ridges(
    hessian: NDArray[np.float32],
    cells: IntArray,
    offsets: IntArray,
    weights: NDArray[np.float32],
    across: NDArray[np.float32],
) -> NDArray[np.float32]:
    """The weaker curvature across the best line through each cell; positive on bright tubes."""
    last = (hessian.shape[0] - 1, hessian.shape[1] - 1, hessian.shape[2] - 1)
    strongest = np.empty(len(cells), dtype=np.float32)
    for n in prange(len(cells)):
        best = -np.inf
        for d in range(offsets.shape[0]):
            xx = yy = zz = xy = xz = yz = 0.0
            for t in range(offsets.shape[1]):
                i = min(max(cells[n, 0] + offsets[d, t, 0], 0), last[0])
                j = min(max(cells[n, 1] + offsets[d, t, 1], 0), last[1])
                k = min(max(cells[n, 2] + offsets[d, t, 2], 0), last[2])
                weight = weights[t]
                xx += weight * hessian[i, j, k, 0]
                yy += weight * hessian[i, j, k, 1]
                zz += weight * hessian[i, j, k, 2]
                xy += weight * hessian[i, j, k, 3]
                xz += weight * hessian[i, j, k, 4]
                yz += weight * hessian[i, j, k, 5]
            a, b, c = across[d, 0]
            e, f, g = across[d, 1]
            first = xx * a * a + yy * b * b + zz * c * c + 2.0 * (xy * a * b + xz * a * c + yz * b * c)
            second = xx * e * e + yy * f * f + zz * g * g + 2.0 * (xy * e * f + xz * e * g + yz * f * g)
            both = xx * a * e + yy * b * f + zz * c * g + xy * (a * f + b * e) + xz * (a * g + c * e)
            both += yz * (b * g + c * f)
            weaker = 0.5 * (first + second) + math.sqrt(0.25 * (first - second) ** 2 + both * both)
            best = max(best, -weaker)
        strongest[n] = best
    return strongest
