"""Localized contours from slice to slice (dissertation, section 3.2.1 a): each starts from its neighbour.

A 2-D contour alone leaks where the border is faint, and its capture range is about the ball's radius. So
it starts from what both its neighbour and the reachable region say, gets no more than a few millimetres
away from that, and its neighbour's outline limits it by what an organ's border moves between slices.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.protocols import Progress
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.contours.localized_contour import ContourResult, LocalizedContourParameters, evolve
from glisson.preoperative.contours.signed_distance import signed_distance_of_mask

_FREEDOM_MM = 2.0
"""How far a contour may get from where the reachable region ends; a pixel where these are larger."""

_GROWTH_PER_MM = 4.0
"""How far the outline may grow into the next slice for each mm between them …"""

_LEAST_GROWTH_MM = 6.0
""" … and at least."""

_SMALLEST_AREA_MM2 = 25.0
"""An organ whose area falls below this has ended."""


@dataclass(frozen=True, eq=False)
class SliceContour:
    """What happened in one slice: area of start and result, how far the contour moved, how much of it is held.

    `held` is the fraction of the final contour that came to its outer limit.
    """

    start_mm2: float
    area_mm2: float
    moved_mm: float
    held: float
    converged: bool


def propagate(
    smooth: NDArray[np.float32],
    region: NDArray[np.bool_],
    spacing_mm: FloatArray,
    parameters: LocalizedContourParameters,
    progress: Progress,
) -> tuple[NDArray[np.bool_], dict[int, SliceContour]]:
    """Contours from the slice with the largest area to both ends.

    Args:
        smooth: smoothed grey values (row, column, slice).
        region: the reachable region, same shape, not empty.
        spacing_mm: voxel spacing (3,).
        parameters: forces of the contour.
        progress: told how far it is.

    Returns:
        The mask (row, column, slice), and what happened in each slice that has a contour.
    """
    areas = region.sum(axis=(0, 1))
    first = int(np.argmax(areas))
    mask = np.zeros(region.shape, dtype=bool)
    contours: dict[int, SliceContour] = {}
    total = int((areas > 0).sum())
    for direction in (1, -1):
        k, before = (first, None) if direction == 1 else (first - 1, mask[:, :, first])
        while 0 <= k < region.shape[2]:
            found = _contour(smooth[:, :, k], region[:, :, k], before, spacing_mm, parameters)
            if found is None:
                break
            mask[:, :, k], contours[k] = found
            before = mask[:, :, k]
            progress(len(contours) / total, f"contour of slice {k}")
            k += direction
    return mask, contours


def _contour(
    image: NDArray[np.float32],
    region: NDArray[np.bool_],
    before: NDArray[np.bool_] | None,
    spacing_mm: FloatArray,
    parameters: LocalizedContourParameters,
) -> tuple[NDArray[np.bool_], SliceContour] | None:
    """The contour of one slice, None where the organ has ended."""
    in_plane = spacing_mm[:2]
    pixel = float(np.prod(in_plane))
    start = region
    if before is not None:
        growth = max(_LEAST_GROWTH_MM, _GROWTH_PER_MM * float(spacing_mm[2]))
        near = distance_inside(~before, in_plane) <= growth
        start = _parts_touching(region & near, near & before)
    if start.sum() * pixel < _SMALLEST_AREA_MM2:
        return None
    freedom = max(_FREEDOM_MM, float(in_plane.max()))
    result = evolve(image, start, in_plane, parameters, freedom)
    if result.mask.sum() * pixel < _SMALLEST_AREA_MM2:
        return None
    contour = SliceContour(
        start_mm2=float(start.sum()) * pixel,
        area_mm2=float(result.mask.sum()) * pixel,
        moved_mm=result.moved_mm,
        held=_held(result, start, in_plane, freedom),
        converged=result.converged,
    )
    return result.mask, contour


def _parts_touching(mask: NDArray[np.bool_], other: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The connected parts of a 2-D mask that overlap with another mask."""
    numbered, _ = ndimage.label(mask)
    kept = np.unique(numbered[other & mask])
    touching: NDArray[np.bool_] = np.isin(numbered, kept[kept > 0])
    return touching


def _held(result: ContourResult, start: NDArray[np.bool_], spacing_mm: FloatArray, freedom_mm: float) -> float:
    """Fraction of the contour that came to its outer limit and would go on."""
    pixel = float(spacing_mm.mean())
    contour = np.abs(result.phi) < 0.5 * pixel
    if not contour.any():
        return 0.0
    away = signed_distance_of_mask(start, spacing_mm)[contour]
    return float((away > freedom_mm - 0.25 * pixel).mean())
