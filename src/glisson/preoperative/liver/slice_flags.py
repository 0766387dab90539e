"""Which slices of a segmentation a person should look at, and why.

Some of it is told by the contours: that one stood still, wanted to leave the organ, or was changed much by the
clean-up. The rest is seen in the mask itself, however it was made. An organ goes on from slice to slice, so what
is there, or is not, for a few slices only is suspicious: a leak comes and goes, a contour that stalled or missed a
tumour leaves a gap between the slices above and below, if the gap holds tissue and no fat (the residues of opening
and closing by a line along the slices' axis; Serra 1982). A part of other grey values is a vessel or a tumour where
the organ encloses it, and else a neighbour. And where much of the surroundings looks like the organ, its border was
guessed. Last, what is as bright as the organ but hangs on it by a narrow passage only, or is the heart, was not reached
by the region that the contours start from (`reachable`), and is a leak wherever it goes.
"""

from collections import defaultdict
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.intensity_prior import IntensityPrior
from glisson.preoperative.liver.propagation import SliceContour

_HELD = 0.3
"""Fraction of a contour at its outer limit above which it wants to leave the organ."""

_STALLED_PIXELS = 0.05
"""A contour that moved less than this is not better than what it started from."""

_CHANGED, _LEAST_CHANGE_MM2 = 0.25, 300.0
"""Change of a slice's area by the clean-up, as a fraction and at least, that is much."""

_FEW_MM = 28.0
"""What is there, or absent, over a shorter height does not go on."""

_EXTRA_RADIUS_MM, _EXTRA_MM2 = 4.0, 180.0
"""A part that is too much holds a disc of this radius, and parts in a slice have this area: rims don't."""

_ABSENT_RADIUS_MM, _ABSENT_MM2 = 2.0, 200.0
"""The same of a part that is absent."""

_DARKEST_HU = 25.0
"""What is darker than a tumour in a gap is fat, water or partly so."""

_CALM_MM = 2.0
"""Standard deviation of the Gaussian by which noise is taken out where parts of other grey values are looked for."""

_FOREIGN_RADIUS_MM, _FOREIGN_MM2 = 4.0, 100.0
"""Such a part holds a disc of this radius in each of its slices, and parts in a slice have this area …"""

_ENCLOSED_SHARE = 0.65
""" … and less than this share of what surrounds it is the organ."""

_RIND_MM = 3.5
"""What surrounds a part is looked at so far around it."""

_BESIDE_MM = 4.0
"""The region ends so near to the organ's border, or nearer."""

_FAINT = 0.35
"""Fraction of a slice's surroundings with the organ's own grey values above which its border is guessed."""

_SURROUNDINGS_MM = (1.5, 4.0)
"""Distances from the border between which the surroundings are looked at."""

Reasons = dict[int, list[str]]
"""What is wrong with slices by their numbers."""


def flag_slices(
    contours: Mapping[int, SliceContour],
    mask: NDArray[np.bool_],
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    grid: WorkingGrid,
    region: NDArray[np.bool_] | None = None,
) -> list[tuple[int, str]]:
    """Slices (the scan's numbers) with a sentence each.

    Args:
        contours: what happened in each working slice.
        mask: the cleaned mask (row, column, slice) on the working grid.
        smooth: smoothed grey values there.
        prior: the organ's grey values.
        grid: the working grid.
        region: what is reached from the organ's middle, as for `suspicious_slices`.
    """
    reasons = suspicious_slices(mask, smooth, prior, grid.spacing_mm, region)
    areas = mask.sum(axis=(0, 1)) * float(np.prod(grid.spacing_mm[:2]))
    for k, contour in contours.items():
        reasons[k] += _contour_reasons(contour, float(areas[k]), float(grid.spacing_mm[:2].mean()))
    flags = []
    for k in sorted(reasons):
        if reasons[k]:
            sentence = "; ".join(reasons[k])
            flags.append((grid.slices(k)[0], sentence[0].upper() + sentence[1:] + "."))
    return flags


def suspicious_slices(
    mask: NDArray[np.bool_],
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    spacing_mm: FloatArray,
    region: NDArray[np.bool_] | None = None,
) -> Reasons:
    """What looks wrong in a mask, whatever made it; an empty one is not judged.

    Args:
        mask: the organ (row, column, slice).
        smooth: smoothed grey values, same shape.
        prior: the organ's grey values.
        spacing_mm: voxel spacing (3,).
        region: what is reached from the organ's middle (`reachable`), if that is known.
    """
    reasons: Reasons = defaultdict(list)
    slices = np.flatnonzero(mask.any(axis=(0, 1)))
    if len(slices) == 0:
        return reasons
    few = max(int(_FEW_MM / spacing_mm[2]), 1)
    pixel_mm2 = float(np.prod(spacing_mm[:2]))
    gaps = _between(mask) & (_heights(~mask) <= few)
    tissue = (smooth > _DARKEST_HU) & (smooth < prior.mean + prior.half_width)
    # A gap would make what is above and below look short-lived.
    extra = (mask | gaps) & (_heights(mask | gaps) <= few) & mask
    foreign = _foreign(mask, smooth, prior, spacing_mm).sum(axis=(0, 1)) * pixel_mm2
    apart = np.zeros_like(mask) if region is None else _not_reached(mask, region, smooth, prior, spacing_mm)
    for k in range(int(slices[0]), int(slices[-1]) + 1):
        here = mask[:, :, k]
        if not here.any():
            reasons[k].append("empty, between slices with the organ")
            continue
        absent = _reached(gaps[:, :, k] & tissue[:, :, k], spacing_mm, _ABSENT_RADIUS_MM).sum() * pixel_mm2
        if absent > _ABSENT_MM2:
            reasons[k].append(f"stalled or incomplete: {absent:.0f} mm² are absent that are there above and below")
        beyond = _reached(extra[:, :, k], spacing_mm, _EXTRA_RADIUS_MM).sum() * pixel_mm2
        if beyond > _EXTRA_MM2:
            reasons[k].append(f"leak suspected: {beyond:.0f} mm² are there in a few slices only")
        if foreign[k] > _FOREIGN_MM2:
            reasons[k].append(f"leak suspected: {foreign[k]:.0f} mm² at the border have other grey values")
        unreached = _reached(apart[:, :, k], spacing_mm, _EXTRA_RADIUS_MM).sum() * pixel_mm2
        if unreached > _EXTRA_MM2:
            reasons[k].append(f"leak suspected: {unreached:.0f} mm² hang on the organ by a narrow passage only")
        faint = _faint_border(here, smooth[:, :, k], prior, spacing_mm)
        if faint > _FAINT:
            reasons[k].append(f"faint border: {100.0 * faint:.0f} % of the surroundings look like the organ")
    return reasons


def _contour_reasons(contour: SliceContour, area_mm2: float, pixel_mm: float) -> list[str]:
    reasons = []
    if contour.held > _HELD:
        reasons.append(f"leak suspected: {100.0 * contour.held:.0f} % of the contour stands at its outer limit")
    if contour.moved_mm < _STALLED_PIXELS * pixel_mm:
        reasons.append(f"stalled: the contour moved {contour.moved_mm:.2f} mm, less than the noise")
    if abs(area_mm2 - contour.area_mm2) > max(_CHANGED * contour.area_mm2, _LEAST_CHANGE_MM2):
        reasons.append(f"clean-up changed the area from {contour.area_mm2:.0f} to {area_mm2:.0f} mm²")
    return reasons


def _between(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What is not in the mask, but has some of it above and some below."""
    below = np.maximum.accumulate(mask, axis=2)
    above = np.maximum.accumulate(mask[:, :, ::-1], axis=2)[:, :, ::-1]
    between: NDArray[np.bool_] = below & above & ~mask
    return between


def _heights(mask: NDArray[np.bool_]) -> IntArray:
    """For each voxel of a mask the number of slices over which it goes on without a break; 0 elsewhere."""
    heights = np.zeros(mask.shape, dtype=np.int64)
    last = mask.shape[2] - 1
    for k in range(last + 1):
        heights[:, :, k] = np.where(mask[:, :, k], 1 + (heights[:, :, k - 1] if k else 0), 0)
    for k in range(last - 1, -1, -1):
        goes_on = mask[:, :, k] & mask[:, :, k + 1]
        heights[:, :, k] = np.where(goes_on, heights[:, :, k + 1], heights[:, :, k])
    return heights


def _reached(part: NDArray[np.bool_], spacing_mm: FloatArray, radius_mm: float) -> NDArray[np.bool_]:
    """What of a part of a slice is reached by a disc of this radius inside it."""
    cores = distance_inside(part, spacing_mm[:2]) > radius_mm
    if not cores.any():
        return np.zeros(part.shape, dtype=bool)
    reached: NDArray[np.bool_] = part & (distance_inside(~cores, spacing_mm[:2]) <= radius_mm)
    return reached


def _foreign(
    mask: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, spacing_mm: FloatArray
) -> NDArray[np.bool_]:
    """Parts of a mask that have other grey values than the organ and are not enclosed by it."""
    # Only what is in the mask counts, or its border's partial volumes would.
    inside = np.where(mask, np.clip(smooth, *prior.visible), np.float32(prior.mean))
    calm = ndimage.gaussian_filter(inside, _CALM_MM / spacing_mm)
    other: NDArray[np.bool_] = mask & (np.abs(calm - prior.mean) > prior.half_width)
    for k in range(mask.shape[2]):
        other[:, :, k] = _reached(other[:, :, k], spacing_mm, _FOREIGN_RADIUS_MM)
    parts, _ = ndimage.label(other)
    margin = np.ceil(_RIND_MM / spacing_mm).astype(int)
    for number, place in enumerate(ndimage.find_objects(parts), start=1):
        box = tuple(slice(max(side.start - m, 0), side.stop + m) for side, m in zip(place, margin, strict=True))
        part = parts[box] == number
        rind = (distance_inside(~part, spacing_mm) <= _RIND_MM) & ~part
        if (rind & mask[box]).sum() >= _ENCLOSED_SHARE * rind.sum():
            other[box] &= ~part
    return other


def _not_reached(
    mask: NDArray[np.bool_],
    region: NDArray[np.bool_],
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    spacing_mm: FloatArray,
) -> NDArray[np.bool_]:
    """What of a mask is as bright as the organ, and yet lies outside the region."""
    alike = np.abs(smooth - prior.mean) < prior.half_width
    apart: NDArray[np.bool_] = mask & alike & (distance_inside(~region, spacing_mm) > _BESIDE_MM)
    return apart


def _faint_border(
    mask: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, spacing_mm: FloatArray
) -> float:
    """Fraction of what lies a few millimetres outside a slice's mask that has the organ's grey values."""
    distance = distance_inside(~mask, spacing_mm[:2])
    near = (distance > _SURROUNDINGS_MM[0]) & (distance <= max(_SURROUNDINGS_MM[1], 1.5 * float(spacing_mm[0])))
    return float((np.abs(smooth[near] - prior.mean) < prior.half_width).mean()) if near.any() else 0.0
