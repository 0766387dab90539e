"""Tumours at the organ's surface, which its grey-value band leaves out.

A tumour inside is a hole and is simply filled. One at the surface leaves a bay: what a ball as large as a
tumour can't enter. Bays also hold fissures full of fat, which are narrow, and the gallbladder, which is as
dark as water; a neighbouring organ is not enclosed by the liver as a tumour is. From its bay the tumour is
followed outward as far as its own grey values go.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.components import slices_filled
from glisson.preoperative.liver.intensity_prior import IntensityPrior
from glisson.preoperative.liver.piece import like_piece

_BAY_MM = 25.0
"""Radius of the ball that does not enter a bay."""

_DARKEST_HU = -15.0
"""What is darker is fat."""

_WATER_HU = 25.0
"""A body with a lower median is a gallbladder or bowel (tumours have liquid parts, too, but more else)."""

_THINNEST_MM = 2.5
"""Radius of the ball that a tumour in its bay must be able to hold: fissures and vessel walls are thinner."""

_SMALLEST_ML = 2.0

_REACH_MM = 45.0
"""How far from its bay's middle a tumour may go on."""

_RIND_MM = 3.0
"""What surrounds a body is looked at so far around it."""

_ENCLOSED_SHARE = 0.42
"""Share of liver in what surrounds a tumour in its bay; on phantoms and scans tumours have 0.44 to 0.66."""


def surface_tumours(
    organ: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, spacing_mm: FloatArray
) -> NDArray[np.bool_]:
    """The dark bodies in bays of the organ's mask (a, b, c), followed outward, same shape."""
    found = np.zeros(organ.shape, dtype=bool)
    if not organ.any():
        return found
    # All this is local, and the organ fills a small part of the scan.
    box = _about(organ, spacing_mm)
    here, values, inside = found[box], smooth[box], organ[box]
    outside = ~inside & (values < prior.mean - 0.25 * prior.half_width)
    for body, middle in _bodies(inside, values, prior, spacing_mm):
        here |= body | like_piece(values, outside, spacing_mm, middle, _REACH_MM)
    return found


def without_gaps(
    organ: NDArray[np.bool_], smooth: NDArray[np.float32], spacing_mm: FloatArray, radius_mm: float
) -> NDArray[np.bool_]:
    """The mask closed by a ball, but for fat and air, and with everything that a slice encloses (vessels)."""
    return slices_filled(organ | (_closed(organ, spacing_mm, radius_mm) & (smooth > 0.0)))


def _bodies(
    organ: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, spacing_mm: FloatArray
) -> Iterator[tuple[NDArray[np.bool_], tuple[int, int, int]]]:
    """Each tumour as far as it lies in its bay, and its deepest voxel."""
    dark = (smooth > _DARKEST_HU) & (smooth < prior.mean - 0.5 * prior.half_width) & ~organ
    dark &= _closed(organ, spacing_mm, _BAY_MM)
    depth = distance_inside(dark, spacing_mm)
    cores, count = ndimage.label(depth > _THINNEST_MM)
    if count == 0:
        return
    distance, nearest = ndimage.distance_transform_edt(cores == 0, sampling=spacing_mm, return_indices=True)
    bodies = cores[tuple(nearest)] * (dark & (distance < _THINNEST_MM + 1.0))
    for number in range(1, count + 1):
        body = bodies == number
        if body.sum() * float(np.prod(spacing_mm)) * 1e-3 < _SMALLEST_ML or np.median(smooth[body]) < _WATER_HU:
            continue
        rind = (distance_inside(~body, spacing_mm) <= _RIND_MM) & ~body
        if (rind & organ).sum() > _ENCLOSED_SHARE * rind.sum():
            a, b, c = np.unravel_index(int(np.argmax(np.where(body, depth, 0.0))), body.shape)
            yield body, (int(a), int(b), int(c))


def _closed(organ: NDArray[np.bool_], spacing_mm: FloatArray, radius_mm: float) -> NDArray[np.bool_]:
    """The mask and what a ball of this radius outside it can't reach; the scan's end is no border."""
    outside = distance_inside(~organ, spacing_mm) > radius_mm
    closed: NDArray[np.bool_] = distance_inside(~outside, spacing_mm) > radius_mm
    return closed


def _about(organ: NDArray[np.bool_], spacing_mm: FloatArray) -> tuple[slice, ...]:
    """The block of a mask and of what a ball may touch about it."""
    margin = np.ceil(max(_BAY_MM, _REACH_MM) / spacing_mm).astype(int) + 1
    places = [np.flatnonzero(organ.any(axis=tuple(b for b in range(3) if b != a))) for a in range(3)]
    return tuple(slice(max(int(p[0] - m), 0), int(p[-1] + m + 1)) for p, m in zip(places, margin, strict=True))
