"""What grey values the organ has, from the surroundings of a click."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray

SOFT_TISSUE_HU = (-30.0, 250.0)
"""Range of everything that can be a liver, contrasted or fatty, with its vessels and tumours."""

_REACH_MM = 12.0
"""Standard deviation of the Gaussian weight about the click."""

_BINS = 280


@dataclass(frozen=True)
class IntensityPrior:
    """The organ's most frequent grey value and the robust spread about it (HU)."""

    mean: float
    deviation: float

    @property
    def half_width(self) -> float:
        """Half of the band of grey values that the organ's tissue has (HU).

        Smoothed tissue spreads little about a click and more over a whole organ, so the band is not
        narrower than 16 HU; above 28 HU it would hold neighbouring organs.
        """
        return float(np.clip(5.0 * self.deviation, 16.0, 28.0))


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
    for _ in range(20):  # mean shift with a window of 25 HU settles within a few
        near = np.abs(value - mode) < 25.0
        mode = float(np.average(value[near], weights=weight[near]))
    near = np.abs(value - mode) < 40.0
    distances = np.abs(value[near] - mode)
    order = np.argsort(distances)
    total = np.cumsum(weight[near][order])
    median = float(distances[order][int(np.searchsorted(total, 0.5 * total[-1]))])
    return IntensityPrior(mode, 1.4826 * median)


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
