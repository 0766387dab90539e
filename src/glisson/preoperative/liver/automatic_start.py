"""Where the liver is, without a click: the widest even tissue on the patient's right, below the lungs.

Nothing else there is as wide in every direction and as even. So for one grey value after the other the
band about it is taken, and the widest ball that lies in the band. Muscle is flat, bowel and kidneys are
narrower, heart, spleen and stomach lie to the left.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.image import Grid
from glisson.core.status import Status
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.components import largest_part, slices_filled
from glisson.preoperative.imaging.working_grid import WorkingGrid

_COARSE_MM = 3.0
"""Size of the voxels in which is looked: vessels thinner than this are blurred away."""

_LEVELS_HU = np.arange(25.0, 200.0, 8.0)
"""Grey values of livers: fatty and without contrast agent, up to the portal phase."""

_BAND_HU = 18.0
"""Half of the band about a level."""

_SHARE = 0.65
"""A voxel is even where so much of its surroundings lies in the band."""

_AIR_HU = -250.0
_LUNG_HU = -500.0
_SMALLEST_LUNG_ML = 20.0
_NARROWEST_MM = 18.0
"""Radius of the ball that a liver holds at least."""

_BELOW_LUNG_MM, _ABOVE_LUNG_MM = 200.0, 150.0
"""The liver's middle lies so far below the lungs' lowest point at most, and so far above it."""

_RIVAL = 0.85
"""Another place with a ball so wide, as a fraction of the widest, might be the liver, too."""


@dataclass(frozen=True, eq=False)
class Start:
    """Where the liver seems to be.

    `point_mm` is the middle of the widest ball, (3,) LPS mm; `rival_mm` (3,) is another place that is almost as
    likely, None where there is none.
    """

    point_mm: FloatArray
    rival_mm: FloatArray | None


def find_start(smooth: NDArray[np.float32], working: WorkingGrid, grid: Grid) -> Start:
    """The start of a liver's segmentation.

    Args:
        smooth: smoothed HU on the working grid (a, b, c).
        working: the working grid.
        grid: that of the scan, which says where the patient's right is.

    Raises:
        StageFailed: there is no tissue like a liver's.
    """
    steps = np.maximum(np.rint(_COARSE_MM / working.spacing_mm), 1).astype(int)
    coarse = ndimage.uniform_filter(smooth, tuple(steps))[tuple(slice(s // 2, None, s) for s in steps)]
    spacing = working.spacing_mm * steps
    points = _points(coarse.shape, steps, working, grid)
    likely = _likely_places(coarse, spacing, points)
    radius, best = _widest(coarse, spacing, likely, np.zeros(coarse.shape, dtype=bool))
    if best is None or radius < _NARROWEST_MM:
        raise StageFailed(
            "No organ like a liver was found: nowhere on the patient's right does even tissue hold a ball of "
            f"{_NARROWEST_MM:.0f} mm radius (the widest has {radius:.0f} mm). If the liver is in the scan, click into "
            "it: --seed-point X,Y,Z (LPS mm).",
            Status.STAGNATED,
        )
    around = np.sqrt(((points - points[best]) ** 2).sum(axis=-1)) < 2.0 * radius
    second, other = _widest(coarse, spacing, likely, around)
    rival = points[other] if other is not None and second > _RIVAL * radius else None
    return Start(points[best], rival)


def _points(shape: tuple[int, ...], steps: NDArray[np.int_], working: WorkingGrid, grid: Grid) -> FloatArray:
    """Places (a, b, c, 3), LPS mm, of the coarse voxels' middles."""
    factors = np.asarray(working.factors) * steps
    axes = [(np.arange(n) * f + 0.5 * (f - 1)) for n, f in zip(shape, factors, strict=True)]
    turned = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    indices = turned[..., np.argsort(working.order)]
    return grid.points_from_indices(indices.reshape(-1, 3)).reshape(*shape, 3)


def _likely_places(coarse: NDArray[np.float32], spacing_mm: FloatArray, points: FloatArray) -> NDArray[np.bool_]:
    """Where the liver's middle may lie: right of the body's middle, near the lungs' lower end where they are seen."""
    body = _body(coarse)
    if not body.any():
        return body
    likely: NDArray[np.bool_] = body & (points[..., 0] < np.median(points[..., 0][body]))
    lungs, count = ndimage.label(body & (coarse < _LUNG_HU))
    if count:
        sizes = np.bincount(lungs.ravel())
        sizes[0] = 0
        large = sizes * float(np.prod(spacing_mm)) * 1e-3 > _SMALLEST_LUNG_ML
        # Air that lies lower than the highest by a lung's height is bowel gas.
        heights = points[..., 2]
        inside = large[lungs]
        if inside.any():
            highest = int(lungs.ravel()[np.argmax(np.where(inside, heights, -np.inf))])
            lowest = float(heights[lungs == highest].min())
            likely &= (heights > lowest - _BELOW_LUNG_MM) & (heights < lowest + _ABOVE_LUNG_MM)
    return likely


def _body(coarse: NDArray[np.float32]) -> NDArray[np.bool_]:
    """The patient with his lungs, without the table: largest part of what is no air, filled slice by slice."""
    return slices_filled(largest_part(ndimage.binary_opening(coarse > _AIR_HU, iterations=2)))


def _widest(
    coarse: NDArray[np.float32], spacing_mm: FloatArray, likely: NDArray[np.bool_], excluded: NDArray[np.bool_]
) -> tuple[float, tuple[int, int, int] | None]:
    """Radius (mm) and middle of the widest ball in an even band about any level, its middle in a likely place."""
    widest, place = 0.0, None
    allowed = likely & ~excluded
    for level in _LEVELS_HU:
        band = (np.abs(coarse - level) < _BAND_HU).astype(np.float32)
        even = ndimage.uniform_filter(band, 3) > _SHARE
        depth = distance_inside(even, spacing_mm) * allowed
        best = int(np.argmax(depth))
        if depth.flat[best] > widest:
            a, b, c = np.unravel_index(best, depth.shape)
            widest, place = float(depth.flat[best]), (int(a), int(b), int(c))
    return widest, place
