"""The block of a scan about a click, without noise, and what was clicked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.image import Volume
from glisson.preoperative.imaging.clicked import block_about_click
from glisson.preoperative.imaging.ct import VISIBLE_HU
from glisson.preoperative.imaging.diffusion import diffused
from glisson.preoperative.imaging.slope import slope
from glisson.preoperative.imaging.surroundings import distance_from

_LEAST_NOISE = 0.02
"""Of a CT in HU / 100 and of an MR as part of its signal: less noise is none that a scanner has."""

_SMOOTHED_MM = 3.7
"""Diffusion reaches about so far; each of its steps half of the smallest spacing, and n of them √n as far."""

_MOST_STEPS = 40
_CALM_MM = 3.0
_NOISE_MM = 20.0
_EVEN_PERCENT = 25.0


@dataclass(frozen=True, eq=False)
class Block:
    """Voxels [i, j, k] about a click.

    `place` is the block's place in the scan, `values` the smoothed grey values, `noise` the standard deviation that is
    left in them, `distance_mm` each voxel's distance from the one that was clicked, and `clicked` the grey value there.
    """

    place: tuple[slice, ...]
    spacing_mm: FloatArray
    values: NDArray[np.float32]
    noise: float
    distance_mm: FloatArray
    clicked: float

    def ball(self, radius_mm: float) -> NDArray[np.bool_]:
        """Voxels so near to the click, at least its neighbours."""
        near: NDArray[np.bool_] = self.distance_mm <= max(radius_mm, float(self.spacing_mm.max()))
        return near


def block_about(volume: Volume, point_mm: FloatArray, reach_mm: float) -> Block:
    """The block that reaches so many mm to all sides of a click (3,), LPS mm.

    Raises:
        BadInput: the click lies outside the scan.
    """
    spacing = volume.grid.spacing_mm
    place, centre = block_about_click(volume.grid, point_mm, reach_mm)
    raw = volume.voxels[place].astype(np.float32)
    if volume.modality == "CT":
        raw = np.clip(raw, *VISIBLE_HU)
    distance = distance_from(centre, raw.shape, spacing)
    about = distance <= _NOISE_MM
    least = _LEAST_NOISE * (100.0 if volume.modality == "CT" else float(np.median(np.abs(raw[about]))) + 1e-6)
    steps = min(round((_SMOOTHED_MM / (float(spacing.min()) + 1e-9)) ** 2), _MOST_STEPS)
    values = diffused(raw, spacing, 2.0 * max(_noise(raw, about, spacing), least), max(steps, 1))
    return Block(place, spacing, values, max(_noise(values, about, spacing), least), distance, float(values[centre]))


def _noise(values: NDArray[np.float32], about: NDArray[np.bool_], spacing_mm: FloatArray) -> float:
    """Standard deviation from what is about each voxel, where that is even: borders of tissues are no noise."""
    calm = ndimage.gaussian_filter(values, _CALM_MM / spacing_mm)
    steepness = slope(calm, spacing_mm)
    even = about & (steepness <= np.percentile(steepness[about], _EVEN_PERCENT))
    return 1.4826 * float(np.median(np.abs(values - calm)[even]))
