"""What grey values the organ has: from the surroundings of a click first, then from the organ itself."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside

SOFT_TISSUE_HU = (-30.0, 250.0)
"""Range of everything that can be a liver, contrasted or fatty, with its vessels and tumours."""

_REACH_MM = 12.0
"""Standard deviation of the Gaussian weight about the click."""

_BINS = 280
_MODE_WINDOW, _SPREAD_WINDOW = 25.0, 40.0


_LOCAL_BAND, _ORGAN_BAND = 5.0, 3.0
"""Half of the band in deviations: tissue spreads little about a click, and more over a whole organ."""

_NARROWEST, _WIDEST = 16.0, 28.0
"""Half of the narrowest and the widest band (HU); a wider one would hold neighbouring organs."""

_VISIBLE = 3.0
"""What differs from the organ by more half widths than this is cut off there."""

_INSIDE_MM = 5.0
"""What lies so deep in a region is not its border's partial volumes."""


@dataclass(frozen=True)
class IntensityPrior:
    """The organ's most frequent grey value and the robust spread about it (HU); `band` in deviations to each side."""

    mean: float
    deviation: float
    band: float = _LOCAL_BAND

    @property
    def half_width(self) -> float:
        """Half of the band of grey values that the organ's tissue has (HU)."""
        return float(np.clip(self.band * self.deviation, _NARROWEST, _WIDEST))

    @property
    def visible(self) -> tuple[float, float]:
        """Least and greatest grey value to look at about the organ: lung and bone would blind means to all between."""
        return self.mean - _VISIBLE * self.half_width, self.mean + _VISIBLE * self.half_width


def estimate_prior(
    smooth: NDArray[np.float32], spacing_mm: FloatArray, seeds: list[tuple[int, int, int]]
) -> IntensityPrior | None:
    """Mode and spread of the soft tissue about the seeds; None where there is none.

    The mode of a wide neighbourhood is taken, since a click may hit a vessel or a tumour.

    Args:
        smooth: smoothed grey values (a, b, c).
        spacing_mm: voxel spacing (3,).
        seeds: voxels clicked.
    """
    values, weights = [], []
    for seed in seeds:
        value, weight = _around(smooth, spacing_mm, seed)
        values.append(value)
        weights.append(weight)
    value, weight = np.concatenate(values), np.concatenate(weights)
    if weight.sum() <= 0.0:
        return None
    histogram, edges = np.histogram(value, bins=_BINS, range=SOFT_TISSUE_HU, weights=weight)
    bin_width = float(edges[1] - edges[0])
    mode = float(edges[np.argmax(ndimage.gaussian_filter1d(histogram, 6.0 / bin_width))]) + 0.5 * bin_width
    return IntensityPrior(*_mode_and_spread(value, weight, mode))


def organ_prior(
    smooth: NDArray[np.float32], region: NDArray[np.bool_], spacing_mm: FloatArray, prior: IntensityPrior
) -> IntensityPrior:
    """Mode and spread of the soft tissue deep in a region.

    Args:
        smooth: smoothed grey values (a, b, c).
        region: what is the organ for all that is known, same shape.
        spacing_mm: voxel spacing (3,).
        prior: that the region was found with; it is kept where nothing lies deep enough.
    """
    deep = distance_inside(region, spacing_mm) > _INSIDE_MM
    values = smooth[deep].astype(np.float64)
    if not (np.abs(values - prior.mean) < _MODE_WINDOW).any():
        return prior
    return IntensityPrior(*_mode_and_spread(values, np.ones(len(values)), prior.mean), _ORGAN_BAND)


def _mode_and_spread(values: FloatArray, weights: FloatArray, mode: float) -> tuple[float, float]:
    """The mode of weighted values (n,) near a first guess, and the deviation by their median distance from it."""
    for _ in range(20):  # mean shift settles within a few
        near = np.abs(values - mode) < _MODE_WINDOW
        mode = float(np.average(values[near], weights=weights[near]))
    near = np.abs(values - mode) < _SPREAD_WINDOW
    distances = np.abs(values[near] - mode)
    order = np.argsort(distances)
    total = np.cumsum(weights[near][order])
    return mode, 1.4826 * float(distances[order][int(np.searchsorted(total, 0.5 * total[-1]))])


def _around(
    smooth: NDArray[np.float32], spacing_mm: FloatArray, seed: tuple[int, int, int]
) -> tuple[FloatArray, FloatArray]:
    """Soft-tissue values about a seed and their Gaussian weights, (n,) each."""
    box, offsets = [], []
    for axis in range(3):
        reach = int(3.0 * _REACH_MM / spacing_mm[axis])
        low, high = max(seed[axis] - reach, 0), min(seed[axis] + reach + 1, smooth.shape[axis])
        box.append(slice(low, high))
        offsets.append((np.arange(low, high) - seed[axis]) * spacing_mm[axis])
    a, b, c = np.meshgrid(*offsets, indexing="ij", sparse=True)
    values = smooth[tuple(box)]
    weights = np.exp(-(a**2 + b**2 + c**2) / (2.0 * _REACH_MM**2))
    soft = (values > SOFT_TISSUE_HU[0]) & (values < SOFT_TISSUE_HU[1])
    return values[soft].astype(np.float64), weights[soft]
