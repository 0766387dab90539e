"""Streaks beside metal and gas: found by what changes from slice to slice as organs do not, and lessened.

Gas that moves while the gantry turns makes rays that contradict each other; metal leaves rays of few photons. Both
streak the soft tissue about them, in each slice in another way. So there the difference of a slice from its neighbours
is larger than elsewhere, and the median of three slices, which keeps a border that goes through them, is nearer to the
truth.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.components import largest_part, slices_filled
from glisson.preoperative.imaging.ct import VISIBLE_HU
from glisson.preoperative.imaging.slope import slope

_AIR_HU = -400.0
_SOFT_HU = (-150.0, 250.0)
_REACH_MM = 60.0
_AROUND_MM = 8.0
_BORDER_MM, _EVEN_HU_MM = 3.0, 4.0
"""Noise is measured where the scan, smoothed so much, changes by less than this: at borders slices differ anyway."""

_STEEP_HU_MM = 12.0
"""Borders of organs are steeper, even among streaks: what lies there is left alone."""

_LEAST_EVEN = 0.1
"""Of a place's surroundings so much has to be even for its noise to be known."""

_NOISIER = 2.0
"""Tissue counts as streaked where its noise is so many times the scan's."""

_SHELL_MM = 4.0
_LEAST_ML = 20.0
_THICKEST_MM = 3.0
"""Of slices farther apart, a neighbour says too little of what lies between."""


@dataclass(frozen=True, eq=False)
class Streaks:
    """Streaked soft tissue `where` (rows, columns, slices), its noise and that of other tissue (HU, deviations)."""

    where: NDArray[np.bool_]
    noise_hu: float
    usual_noise_hu: float


def gas_voxels(hu: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Voxels (rows, columns, slices) of a CT (HU) that are gas inside the body, lungs among them."""
    body = slices_filled(largest_part(hu > _AIR_HU))
    found: NDArray[np.bool_] = body & (hu < _AIR_HU)
    return found


def find_streaks(hu: NDArray[np.float32], sources: NDArray[np.bool_], spacing_mm: FloatArray) -> Streaks | None:
    """Where soft tissue is streaked; None where it is not, or where slices lie too far apart to tell.

    Args:
        hu: the scan (rows, columns, slices), HU.
        sources: its metal and gas.
        spacing_mm: size of its voxels, (3,).
    """
    if hu.shape[2] < 3 or spacing_mm[2] > _THICKEST_MM or not sources.any():
        return None
    squares = _squared_noise(hu)
    variance, known = _local_variance(hu, squares, spacing_mm)
    beside = known & (distance_inside(~sources, spacing_mm) < _REACH_MM)
    if not known.any():
        return None
    usual = float(np.median(variance[known]))
    noisy = beside & (variance > _NOISIER**2 * usual)
    where = _without_shells(noisy, spacing_mm) & ~sources
    if float(where.sum() * np.prod(spacing_mm)) * 1e-3 < _LEAST_ML:
        return None
    return Streaks(where, float(np.sqrt(squares[where].mean())), float(np.sqrt(usual)))


def without_streaks(hu: NDArray[np.float32], streaks: Streaks) -> NDArray[np.float32]:
    """The scan with the median of three slices where it is streaked."""
    median = ndimage.median_filter(hu, size=(1, 1, 3), mode="nearest")
    return np.where(streaks.where, median, hu)


def _squared_noise(hu: NDArray[np.float32]) -> NDArray[np.float32]:
    """What each voxel tells of the noise's variance: a slice's difference from the mean of its neighbours, squared.

    That has 3/2 of the variance where slices are independent.
    """
    across = np.zeros_like(hu)
    across[:, :, 1:-1] = hu[:, :, 1:-1] - 0.5 * (hu[:, :, 2:] + hu[:, :, :-2])
    return across**2 / np.float32(1.5)


def _local_variance(
    hu: NDArray[np.float32], squared_noise: NDArray[np.float32], spacing_mm: FloatArray
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """Variance of the noise about each voxel, and where it is known: in soft tissue away from steep borders."""
    smooth = ndimage.gaussian_filter(np.clip(hu, *VISIBLE_HU), _BORDER_MM / spacing_mm, truncate=3.0)
    soft = (smooth > _SOFT_HU[0]) & (smooth < _SOFT_HU[1])
    steepness = slope(smooth, spacing_mm)
    even = soft & (steepness < _EVEN_HU_MM)
    even &= np.roll(soft, 1, axis=2) & np.roll(soft, -1, axis=2)
    even[:, :, [0, -1]] = False
    sigma = (*(_AROUND_MM / spacing_mm[:2]), 0.0)
    weight = ndimage.gaussian_filter(even.astype(np.float32), sigma, truncate=2.0)
    squares = ndimage.gaussian_filter(np.where(even, squared_noise, np.float32(0.0)), sigma, truncate=2.0)
    known = soft & (steepness < _STEEP_HU_MM) & (weight > _LEAST_EVEN)
    return squares / np.maximum(weight, np.float32(1e-3)), known


def _without_shells(mask: NDArray[np.bool_], spacing_mm: FloatArray) -> NDArray[np.bool_]:
    """A mask without what is thin in its slices: such shells are borders of organs that slant from slice to slice."""
    steps = max(round(_SHELL_MM / float(spacing_mm[:2].min())), 1)
    cross = ndimage.generate_binary_structure(2, 1)[:, :, None]
    opened: NDArray[np.bool_] = ndimage.binary_opening(mask, cross, iterations=steps)
    return opened
