"""The region that the liver's contours start from: about the start that is found, or about the clicks."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import Volume
from glisson.core.status import Status
from glisson.core.units import place_text
from glisson.preoperative.imaging.surroundings import Index, distance_from, surroundings
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.automatic_start import Start, find_start
from glisson.preoperative.liver.completion import surface_tumours, without_gaps
from glisson.preoperative.liver.intensity_prior import IntensityPrior, estimate_prior
from glisson.preoperative.liver.reachable import reachable_region

GAP_MM = 4.0
"""Radius of the ball that closes gaps of a mask."""

_TUMOUR_ROUNDS = 2
_SMALLEST_ML = 100.0

_INTERIOR_MM = 10.0
"""A click of other grey value so near to a region hit one of its vessels or tumours."""


@dataclass(frozen=True, eq=False)
class OrganRegion:
    """What the contours start from, (a, b, c), and the grey values that it was found by."""

    mask: NDArray[np.bool_]
    prior: IntensityPrior

    def holds(self, click: Index, smooth: NDArray[np.float32], spacing_mm: FloatArray) -> bool:
        """Whether a click lies in the region, or in a vessel or tumour of it."""
        if self.mask[click]:
            return True
        if abs(float(smooth[click]) - self.prior.mean) < self.prior.half_width:
            return False
        box, place = surroundings(self.mask.shape, spacing_mm, click, _INTERIOR_MM)
        away = distance_from(place, self.mask[box].shape, spacing_mm)
        return bool((self.mask[box] & (away <= _INTERIOR_MM)).any())


def found_region(
    volume: Volume, smooth: NDArray[np.float32], grid: WorkingGrid, known: NDArray[np.bool_], clicked: list[Index]
) -> tuple[Start | None, OrganRegion | None]:
    """A CT's start that is found without a click and its region; both None where clicks say that it is another organ.

    Raises:
        StageFailed: there is no click, and no start or next to nothing about it.
    """
    if volume.modality != "CT":
        return None, None
    try:
        start = find_start(smooth, grid, volume.grid)
        index = grid.working_index(volume.grid.indices_from_points(start.point_mm[None])[0])
        region = region_about(smooth, grid.spacing_mm, [index], known)
        require_volume(region.mask, grid, start.point_mm)
    except StageFailed:
        if clicked:
            return None, None
        raise
    if all(region.holds(click, smooth, grid.spacing_mm) for click in clicked):
        return start, region
    return None, None


def region_about(
    smooth: NDArray[np.float32], spacing_mm: FloatArray, places: list[Index], known: NDArray[np.bool_]
) -> OrganRegion:
    """The region about some places, with known tumours.

    Raises:
        BadInput: there is no soft tissue.
    """
    prior = estimate_prior(smooth, spacing_mm, places)
    if prior is None:
        raise BadInput("There is no soft tissue about the click; click inside the liver.")
    region = _region_with_tumours(smooth, prior, spacing_mm, places, known)
    return OrganRegion(without_gaps(region, smooth, spacing_mm, GAP_MM), prior)


def _region_with_tumours(
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    spacing_mm: FloatArray,
    clicked: list[Index],
    known: NDArray[np.bool_],
) -> NDArray[np.bool_]:
    """The reachable region with known and surface tumours; a tumour may hide liver that lies behind it."""
    tumours = known
    region = _reachable_with(tumours, smooth, prior, spacing_mm, clicked)
    for _ in range(_TUMOUR_ROUNDS):
        found = surface_tumours(region, smooth, prior, spacing_mm)
        if not found.any():
            break
        tumours = tumours | found
        region = _reachable_with(tumours, smooth, prior, spacing_mm, clicked)
    return region


def _reachable_with(
    tumours: NDArray[np.bool_],
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    spacing_mm: FloatArray,
    clicked: list[Index],
) -> NDArray[np.bool_]:
    healed = np.where(tumours, np.float32(prior.mean), smooth)
    reached = reachable_region(healed, prior, spacing_mm, clicked)
    return reached | tumours if reached.any() else reached


def require_volume(region: NDArray[np.bool_], grid: WorkingGrid, place_mm: FloatArray) -> None:
    """Refuse a region (a, b, c) that is smaller than any liver.

    Raises:
        StageFailed: so it is.
    """
    volume_ml = float(region.sum() * np.prod(grid.spacing_mm)) * 1e-3
    if volume_ml < _SMALLEST_ML:
        raise StageFailed(
            f"Only {volume_ml:.1f} ml of like tissue hang together about {place_text(place_mm)}; "
            "click in a larger, even part of the liver.",
            Status.STAGNATED,
        )
