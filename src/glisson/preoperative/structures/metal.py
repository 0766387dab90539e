"""Wires and stents: thin, bright, and in pieces where a wire is thinner than a voxel.

A wire of half a voxel's width covers a part of it, and is less bright than metal then. What is thin stands out in the
white top-hat; what counts is metal, or stands out half as much as the brightest voxel at the click and more than noise.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import Volume
from glisson.core.status import Status
from glisson.core.units import place_text
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.clicked import block_about_click
from glisson.preoperative.imaging.surroundings import distance_from
from glisson.preoperative.structures.kinds import Kind

_METAL_HU = 800.0
"""Brighter than this is metal; bone's outer layer reaches it only where it is thickest."""

_LEAST_HU = 120.0
"""Metal stands out by more than this, vessels with contrast agent hardly do."""

_THIN_MM = 3.0
_SNAP_MM = 3.0
"""The brightest voxel so near to the click is what was meant: a wire is hard to hit."""

_PART = 0.45
_OF_NOISE = 7.0
_NOISE_MM = 30.0
_VISIBLE_HU = (-200.0, 2000.0)


def metal_about(
    volume: Volume, kind: Kind, point_mm: FloatArray, reach_mm: float, gap_mm: float
) -> tuple[tuple[slice, ...], NDArray[np.bool_]]:
    """The metal at a click (3,), LPS mm: the block of the scan that was looked at, and the mask there.

    Raises:
        BadInput: the scan is no CT, or the click lies outside of it.
        StageFailed: there is no metal.
    """
    if volume.modality != "CT":
        raise BadInput(f"A {kind.noun} gives no signal of its own in an MR, so it cannot be followed; use a CT.")
    spacing = volume.grid.spacing_mm
    place, centre = block_about_click(volume.grid, point_mm, reach_mm)
    values = np.clip(volume.voxels[place], *_VISIBLE_HU).astype(np.float32)
    distance = distance_from(centre, values.shape, spacing)
    size = tuple(int(n) for n in np.maximum(2 * np.rint(_THIN_MM / spacing) + 1, 3))
    hat = values - ndimage.grey_opening(values, size=size)
    at_click = distance <= max(_SNAP_MM, float(spacing.max()))
    brightest = float(hat[at_click].max())
    if brightest < _LEAST_HU:
        raise StageFailed(
            f"There is no metal at {place_text(point_mm)}: nothing thin within {_SNAP_MM:.0f} mm is brighter than its "
            f"surroundings by more than {brightest:.0f} HU; click onto the {kind.noun}.",
            Status.UNOBSERVABLE,
        )
    noise = hat[distance <= _NOISE_MM]
    usual = float(np.median(noise))
    floor = usual + _OF_NOISE * 1.4826 * float(np.median(np.abs(noise - usual)))
    bright = (hat >= min(max(_PART * brightest, floor), brightest)) | (values >= _METAL_HU)
    return place, _linked(bright, at_click, spacing, gap_mm)


def _linked(
    bright: NDArray[np.bool_], start: NDArray[np.bool_], spacing_mm: FloatArray, gap_mm: float
) -> NDArray[np.bool_]:
    """The bright voxels [i, j, k] that hang together with some of them, across gaps of at most `gap_mm`."""
    joined = distance_inside(~bright, spacing_mm) <= 0.5 * gap_mm
    numbered, _ = ndimage.label(joined, structure=np.ones((3, 3, 3)))
    chosen = np.unique(numbered[bright & start])
    found: NDArray[np.bool_] = bright & np.isin(numbered, chosen)
    return found
