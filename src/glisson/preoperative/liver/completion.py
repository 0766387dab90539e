"""Tumours at the organ's surface, which its grey-value band leaves out.

A tumour inside is a hole and is simply filled. One at the surface is a compact body, darker than the
liver, that borders the liver on a good part of its surface; its other side may be fat or lung. A
neighbouring organ, as dark, borders the liver with a small part of its surface only.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.preoperative.liver.intensity_prior import IntensityPrior

_DARKEST = 80.0
"""A tumour is at most so much darker than the liver (HU), and never below the next number (fluid)."""

_DARKEST_HU = 20.0

_THINNEST_MM = 3.5
"""Radius of the ball that a tumour must be able to hold: the diaphragm and vessel walls are thinner."""

_SMALLEST_ML = 0.5

_RIND_MM = 3.0
"""What surrounds a body is looked at so far around it."""

_LIVER_SHARE = 0.35
"""Share of liver in the soft tissue around a tumour; on phantoms most have 0.45 to 0.9, and organs 0.37 at most."""

_ENCLOSED_SHARE = 0.25
"""Share of liver in all that surrounds a tumour, fat and air included; an organ lying in fat beside it has less."""


def surface_tumours(
    organ: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, spacing_mm: FloatArray
) -> NDArray[np.bool_]:
    """The dark bodies beside the organ's mask (a, b, c) that it encloses in good part, same shape."""
    dark = (smooth > max(prior.mean - _DARKEST, _DARKEST_HU)) & (smooth < prior.mean - 0.5 * prior.half_width)
    dark &= ~organ
    found = np.zeros(organ.shape, dtype=bool)
    cores, count = ndimage.label(ndimage.distance_transform_edt(dark, sampling=spacing_mm) > _THINNEST_MM)
    if count == 0:
        return found
    distance, nearest = ndimage.distance_transform_edt(cores == 0, sampling=spacing_mm, return_indices=True)
    bodies = cores[tuple(nearest)] * (dark & (distance < _THINNEST_MM + 1.0))
    soft = (smooth > 0.0) & (smooth < 250.0)
    margin = np.ceil((_RIND_MM + 0.5) / spacing_mm).astype(int)
    for number, box in enumerate(ndimage.find_objects(bodies), start=1):
        if box is None:
            continue
        wide = tuple(slice(max(s.start - m, 0), s.stop + m) for s, m in zip(box, margin, strict=True))
        body = bodies[wide] == number
        if body.sum() * float(np.prod(spacing_mm)) * 1e-3 < _SMALLEST_ML or not organ[wide].any():
            continue
        rind = (ndimage.distance_transform_edt(~body, sampling=spacing_mm) <= _RIND_MM) & ~body
        liver = int((rind & organ[wide]).sum())
        in_soft_tissue = liver / max(int((rind & (organ[wide] | soft[wide])).sum()), 1)
        if in_soft_tissue > _LIVER_SHARE and liver > _ENCLOSED_SHARE * int(rind.sum()):
            found[wide] |= body
    return found


def without_gaps(
    organ: NDArray[np.bool_], smooth: NDArray[np.float32], spacing_mm: FloatArray, radius_mm: float
) -> NDArray[np.bool_]:
    """The mask closed by a ball, but for fat and air, and with everything that a slice encloses (vessels)."""
    outside = ndimage.distance_transform_edt(~organ, sampling=spacing_mm) > radius_mm
    closed = ndimage.distance_transform_edt(~outside, sampling=spacing_mm) > radius_mm
    whole: NDArray[np.bool_] = organ | (closed & (smooth > 0.0))
    for k in range(whole.shape[2]):
        whole[:, :, k] = ndimage.binary_fill_holes(whole[:, :, k])
    return whole
