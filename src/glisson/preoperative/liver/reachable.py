"""The part of the organ's grey-value band that belongs together with a click.

Organs with the same grey value touch. Where they do the touching part is narrow compared with the organs
on both sides, and mostly their grey values differ a little. So the band is divided into basins of its
distance map (watershed, Beucher and Lantuéjoul 1979), which are joined from the widest passage down:
the narrower the passage and the larger the difference, the less so.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.segmentation import watershed

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.components import largest_part
from glisson.preoperative.liver.intensity_prior import SOFT_TISSUE_HU, IntensityPrior

_NARROWEST_PASSAGE = 0.3
"""Basins of equal grey value are joined when the passage is this fraction as wide as the smaller basin …"""

_PASSAGE_PER_HU = 0.08
""" … and by this much more for each HU between them …"""

_WIDEST_PASSAGE = 0.9
""" … but a passage about as wide as the smaller basin is no passage between two organs, whatever their HU."""

_HEART_SHARE, _HEART_MM = 0.95, 18.0
"""A basin is the heart where so much of it lies between the lungs, and it holds a ball of this radius."""

_VESSEL_AREA_MM2 = 250.0
"""Gaps of the band that are surrounded in a plane and smaller than this are vessels or small tumours."""

_LEAST_APART_MM = 8.0
"""Two basins have their deepest points at least about half of this apart."""


def reachable_region(
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    spacing_mm: FloatArray,
    seeds: list[tuple[int, int, int]],
    detail_mm: float = 6.0,
    thorax: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """The organ as far as grey value and shape tell it, (a, b, c); empty when no tissue is near the seeds.

    Args:
        smooth: smoothed grey values (a, b, c).
        prior: the organ's grey values.
        spacing_mm: voxel spacing (3,).
        seeds: voxels clicked; the basins nearest to them are the organ's.
        detail_mm: radius below which what hangs on the organ is taken for something else (opening).
        thorax: where a wide body is the heart (`between_lungs`), if that is known.
    """
    band = np.abs(smooth - prior.mean) < prior.half_width
    filled = _without_vessel_gaps(band, spacing_mm) & (smooth > SOFT_TISSUE_HU[0])
    distance = distance_inside(filled, spacing_mm)
    width = ndimage.gaussian_filter(distance, 1.5 / spacing_mm) * filled
    # Flat tops and ripples give more basins than needed; their wide passages join them again below.
    size = np.maximum(np.rint(_LEAST_APART_MM / spacing_mm), 3).astype(int)
    markers, count = ndimage.label((width == ndimage.maximum_filter(width, size=tuple(size))) & (width > 0.0))
    if count == 0:
        return np.zeros(band.shape, dtype=bool)
    basins = watershed(-width, markers, mask=filled).astype(np.int64)
    values = np.where(band, smooth, np.float32(prior.mean))
    hearts = np.zeros(count + 1, dtype=bool) if thorax is None else _hearts(basins, count, width, thorax)
    joined = _joined_basins(basins, count, width, values, hearts)
    own = {int(joined[_nearest_label(basins, seed, spacing_mm)]) for seed in seeds}
    region = np.isin(joined[basins], list(own)) & (basins > 0)
    return opened(region, spacing_mm, detail_mm)


def opened(region: NDArray[np.bool_], spacing_mm: FloatArray, radius_mm: float) -> NDArray[np.bool_]:
    """The largest part of a region that a ball of this radius reaches, and a millimetre about it."""
    core = largest_part(distance_inside(region, spacing_mm) > radius_mm)
    result: NDArray[np.bool_] = region & (distance_inside(~core, spacing_mm) < radius_mm + 1.0)
    return result


def _without_vessel_gaps(band: NDArray[np.bool_], spacing_mm: FloatArray) -> NDArray[np.bool_]:
    """Small gaps filled that are surrounded in a plane along two axes: cross-sections of vessels."""
    filled = band.copy()
    for axis in (2, 0, 1):
        in_plane = ndimage.generate_binary_structure(3, 1)
        in_plane[tuple([0, 2] if a == axis else slice(None) for a in range(3))] = False
        gaps, count = ndimage.label(~filled, structure=in_plane)
        areas = np.bincount(gaps.ravel(), minlength=count + 1) * float(np.prod(np.delete(spacing_mm, axis)))
        small = areas < _VESSEL_AREA_MM2
        small[0] = False
        filled |= small[gaps]
    return filled


def _hearts(basins: IntArray, count: int, width: FloatArray, thorax: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether each basin 0 … count is a wide body that lies between the lungs as a whole."""
    inside = np.bincount(basins[thorax], minlength=count + 1)
    size = np.bincount(basins.ravel(), minlength=count + 1)
    widest = np.zeros(count + 1)
    np.maximum.at(widest, basins[thorax], width[thorax])
    hearts: NDArray[np.bool_] = (inside > _HEART_SHARE * size) & (widest > _HEART_MM)
    return hearts


def _joined_basins(
    basins: IntArray, count: int, width: FloatArray, values: NDArray[np.float32], hearts: NDArray[np.bool_]
) -> IntArray:
    """For each basin 0 … count the number of the group that it is joined to, (count + 1,)."""
    numbers = np.arange(count + 1)
    widest, level, size = _basin_properties(basins, count, width, values)
    group, heart = numbers.copy(), hearts.copy()
    for passage, first, second in _passages(basins, count, width):
        a, b = _root(group, first), _root(group, second)
        if a == b:
            continue
        needed = min(_NARROWEST_PASSAGE + _PASSAGE_PER_HU * abs(level[a] - level[b]), _WIDEST_PASSAGE)
        if heart[a] != heart[b]:
            needed = _WIDEST_PASSAGE
        if passage >= needed * min(widest[a], widest[b]):
            group[b] = a
            heart[a] |= heart[b]
            widest[a] = max(widest[a], widest[b])
            level[a] = (level[a] * size[a] + level[b] * size[b]) / (size[a] + size[b])
            size[a] += size[b]
    return np.array([_root(group, n) for n in range(count + 1)], dtype=np.int64)


def _basin_properties(
    basins: IntArray, count: int, width: FloatArray, values: NDArray[np.float32]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Largest width, median grey value and number of voxels of each basin 0 … count (the first means nothing)."""
    cells = np.flatnonzero(basins)
    own, grey = basins.ravel()[cells], values.ravel()[cells]
    order = np.lexsort((grey, own))
    ends = np.searchsorted(own[order], np.arange(1, count + 2))
    starts, size = ends[:-1], np.diff(ends)
    widest = np.maximum.reduceat(width.ravel()[cells][order], starts)
    level = 0.5 * (grey[order][starts + (size - 1) // 2] + grey[order][starts + size // 2])
    return np.append(0.0, widest), np.append(0.0, level), np.append(0.0, size)


def _root(group: IntArray, basin: int) -> int:
    while group[basin] != basin:
        group[basin] = group[group[basin]]
        basin = int(group[basin])
    return basin


def _passages(basins: IntArray, count: int, width: FloatArray) -> list[tuple[float, int, int]]:
    """Largest width on the border of each pair of touching basins, the widest first."""
    widest: dict[int, float] = {}
    for axis in range(3):
        before = tuple(slice(None, -1) if a == axis else slice(None) for a in range(3))
        after = tuple(slice(1, None) if a == axis else slice(None) for a in range(3))
        first, second = basins[before], basins[after]
        touching = (first != second) & (first > 0) & (second > 0)
        low, high = np.minimum(first, second)[touching], np.maximum(first, second)[touching]
        keys, place = np.unique(low * (count + 1) + high, return_inverse=True)
        largest = np.zeros(len(keys))
        np.maximum.at(largest, place, np.minimum(width[before], width[after])[touching])
        for key, value in zip(keys.tolist(), largest.tolist(), strict=True):
            widest[key] = max(widest.get(key, 0.0), value)
    pairs = [(value, key // (count + 1), key % (count + 1)) for key, value in widest.items()]
    return sorted(pairs, reverse=True)


def _nearest_label(basins: IntArray, seed: tuple[int, int, int], spacing_mm: FloatArray) -> int:
    if basins[seed]:
        return int(basins[seed])
    cells = np.argwhere(basins > 0)
    nearest = np.argmin((((cells - seed) * spacing_mm) ** 2).sum(axis=1))
    return int(basins[tuple(cells[nearest])])
