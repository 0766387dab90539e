"""Grey values that agree with the region that they give, so that it matters little where the click was.

A click knows its surroundings only: in a vessel, beside a tumour or in the fatty half of an organ they are not the
organ's. The region that they give is mostly organ all the same, and its grey values give a better region; after a
few rounds neither changes.
"""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.preoperative.liver.intensity_prior import IntensityPrior, organ_prior
from glisson.preoperative.liver.reachable import reachable_region

_ROUNDS = 4
_SETTLED = 0.3
"""Change of the mean and of the deviation (HU) below which nothing changes any more."""

_COARSE_MM = 3.0
"""For its grey values the region need not be finer than this."""


def settled_prior(
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    spacing_mm: FloatArray,
    clicked: list[tuple[int, int, int]],
    thorax: NDArray[np.bool_] | None = None,
) -> IntensityPrior:
    """The organ's grey values, from those about a click; the same where the click's give no region.

    Args:
        smooth: smoothed grey values (a, b, c).
        prior: what the surroundings of the clicks have.
        spacing_mm: voxel spacing (3,).
        clicked: voxels clicked.
        thorax: as for `reachable_region`.
    """
    steps = np.maximum(np.rint(_COARSE_MM / spacing_mm), 1).astype(int)
    every = tuple(slice(None, None, step) for step in steps)
    coarse, spacing = smooth[every], spacing_mm * steps
    between = None if thorax is None else thorax[every]
    seeds = [_coarse_index(index, steps, coarse.shape) for index in clicked]
    for _ in range(_ROUNDS):
        before = prior
        region = reachable_region(coarse, before, spacing, seeds, thorax=between)
        prior = organ_prior(coarse, region, spacing, before)
        if max(abs(prior.mean - before.mean), abs(prior.deviation - before.deviation)) < _SETTLED:
            break
    return prior


def _coarse_index(index: tuple[int, int, int], steps: NDArray[np.int_], shape: tuple[int, ...]) -> tuple[int, int, int]:
    a, b, c = np.minimum(np.rint(np.array(index) / steps), np.array(shape) - 1).astype(int).tolist()
    return a, b, c
