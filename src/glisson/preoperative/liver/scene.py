"""The organ's region about clicks: what can be reached with its grey values, completed by surface tumours."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.completion import surface_tumours, without_gaps
from glisson.preoperative.liver.intensity_prior import IntensityPrior, estimate_prior
from glisson.preoperative.liver.reachable import reachable_region
from glisson.preoperative.liver.settled_prior import settled_prior

GAP_MM = 4.0
"""Radius of the ball that closes gaps between parts of the organ."""

_NEAR_MM = 5.0
"""A click so near to the region that is found without one says that it is the right one."""

_TUMOUR_ROUNDS = 2


@dataclass(frozen=True, eq=False)
class Scene:
    """What a region is found in: smoothed values, voxel spacing, known tumours, and where a wide body is the heart."""

    smooth: NDArray[np.float32]
    spacing_mm: FloatArray
    tumours: NDArray[np.bool_]
    thorax: NDArray[np.bool_] | None

    def reachable(
        self, tumours: NDArray[np.bool_], prior: IntensityPrior, clicked: list[tuple[int, int, int]]
    ) -> NDArray[np.bool_]:
        """The reachable region with tumours, which may hide liver that lies behind them."""
        healed = np.where(tumours, np.float32(prior.mean), self.smooth)
        reached = reachable_region(healed, prior, self.spacing_mm, clicked, thorax=self.thorax)
        return reached | tumours if reached.any() else reached


def region_about(scene: Scene, clicked: list[tuple[int, int, int]]) -> tuple[NDArray[np.bool_], IntensityPrior] | None:
    """The organ's region about clicks, and its grey values; None where there is no soft tissue."""
    smooth, spacing_mm = scene.smooth, scene.spacing_mm
    local = estimate_prior(smooth, spacing_mm, clicked)
    if local is None:
        return None
    prior = settled_prior(smooth, local, spacing_mm, clicked, scene.thorax)
    tumours = scene.tumours
    region = scene.reachable(tumours, prior, clicked)
    for _ in range(_TUMOUR_ROUNDS):
        found = surface_tumours(region, smooth, prior, spacing_mm)
        if not found.any():
            break
        tumours = tumours | found
        region = scene.reachable(tumours, prior, clicked)
    return without_gaps(region, smooth, spacing_mm, GAP_MM), prior


def holds(region: NDArray[np.bool_], clicked: list[tuple[int, int, int]], grid: WorkingGrid) -> bool:
    """Whether the region holds the clicks; a tumour or a border that it lacks may lie a little outside."""
    if not region.any():
        return False
    away = distance_inside(~region, grid.spacing_mm)
    return all(away[index] <= _NEAR_MM for index in clicked)
