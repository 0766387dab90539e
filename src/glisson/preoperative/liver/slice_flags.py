"""Which slices of a propagated segmentation a person should look at, and why."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.intensity_prior import IntensityPrior
from glisson.preoperative.liver.propagation import SliceContour

_JUMP = 0.25
"""Change of area against the mean of both neighbours, as a fraction …"""

_LEAST_JUMP_MM2 = 300.0
""" … and at least; the ends of an organ change quickly."""

_HELD = 0.3
"""Fraction of a contour at its outer limit above which it wants to leave the organ."""

_STALLED_PIXELS = 0.05
"""A contour that moved less than this is not better than what it started from."""


_FAINT = 0.35
"""Fraction of a slice's surroundings with the organ's own grey values above which its border is guessed."""

_SURROUNDINGS_MM = (1.5, 4.0)
"""Distances from the border between which the surroundings are looked at."""


def flag_slices(
    contours: Mapping[int, SliceContour],
    mask: NDArray[np.bool_],
    smooth: NDArray[np.float32],
    prior: IntensityPrior,
    grid: WorkingGrid,
) -> list[tuple[int, str]]:
    """Slices (the scan's numbers) with a sentence each.

    Args:
        contours: what happened in each working slice.
        mask: the cleaned mask (row, column, slice) on the working grid.
        smooth: smoothed grey values there.
        prior: the organ's grey values.
        grid: the working grid.
    """
    pixel_mm2 = float(np.prod(grid.spacing_mm[:2]))
    pixel_mm = float(grid.spacing_mm[:2].mean())
    areas = mask.sum(axis=(0, 1)) * pixel_mm2
    flags = []
    for k, contour in sorted(contours.items()):
        reasons = []
        if 0 < k < len(areas) - 1 and areas[k - 1] > 0.0 and areas[k + 1] > 0.0:
            expected = 0.5 * (areas[k - 1] + areas[k + 1])
            if abs(areas[k] - expected) > max(_JUMP * expected, _LEAST_JUMP_MM2):
                reasons.append(f"area jump: {areas[k]:.0f} mm² between slices of {expected:.0f} mm² on average")
        if contour.held > _HELD:
            reasons.append(f"leak suspected: {100.0 * contour.held:.0f} % of the contour stands at its outer limit")
        if contour.moved_mm < _STALLED_PIXELS * pixel_mm:
            reasons.append(f"stalled: the contour moved {contour.moved_mm:.2f} mm, less than the noise")
        if abs(areas[k] - contour.area_mm2) > max(_JUMP * contour.area_mm2, _LEAST_JUMP_MM2):
            reasons.append(f"clean-up changed the area from {contour.area_mm2:.0f} to {areas[k]:.0f} mm²")
        faint = _faint_border(mask[:, :, k], smooth[:, :, k], prior, grid)
        if faint > _FAINT:
            reasons.append(f"faint border: {100.0 * faint:.0f} % of the surroundings look like the organ")
        if reasons:
            sentence = "; ".join(reasons)
            flags.append((grid.slices(k)[0], sentence[0].upper() + sentence[1:] + "."))
    return flags


def _faint_border(
    mask: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, grid: WorkingGrid
) -> float:
    """Fraction of what lies a few millimetres outside a slice's mask that has the organ's grey values."""
    if not mask.any():
        return 0.0
    distance = ndimage.distance_transform_edt(~mask, sampling=grid.spacing_mm[:2])
    near = (distance > _SURROUNDINGS_MM[0]) & (distance <= max(_SURROUNDINGS_MM[1], 1.5 * float(grid.spacing_mm[0])))
    return float((np.abs(smooth[near] - prior.mean) < prior.half_width).mean()) if near.any() else 0.0
