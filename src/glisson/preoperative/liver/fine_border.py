"""The border of a coarse mask, found again in the scan's own voxels.

A voxel near the border belongs to the side whose grey value about there it is nearer to: one step of the mean
separation of Lankton and Tannenbaum (2008, IEEE Trans. Image Process. 17:2029), by threshold instead of a flow.
"""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.image import Volume
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.components import largest_part, slices_filled
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.intensity_prior import IntensityPrior

_BAND_MM = 2.0
"""The border is looked for so far to either side."""

_ABOUT_MM = 3.0
"""Standard deviation of the Gaussian by which both sides' grey values are averaged."""

_NOISE_MM, _RIPPLES_MM = 1.0, 0.8
"""Standard deviations of the Gaussians that take the noise out of the grey values, and ripples out of the border."""

_MARGIN_MM = 10.0
_FEW = 0.01
"""Where less than this share of the surroundings lies on a side, its grey value is not known."""


def fine_border(
    volume: Volume, organ: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, grid: WorkingGrid
) -> NDArray[np.bool_]:
    """The mask [i, j, k] in the voxels of a CT; just the coarse one where these are no finer.

    Args:
        volume: the CT (HU).
        organ: the mask on the working grid (row, column, slice), not empty.
        smooth: smoothed grey values there.
        prior: the organ's grey values.
        grid: the working grid.
    """
    if max(grid.factors) == 1:
        return grid.full(organ)
    found = ndimage.find_objects(organ.astype(np.uint8))[0]
    margin = np.ceil(_MARGIN_MM / grid.spacing_mm).astype(int)
    low = [max(side.start - m, 0) for side, m in zip(found, margin.tolist(), strict=True)]
    high = [min(side.stop + m, n) for side, m, n in zip(found, margin.tolist(), organ.shape, strict=True)]
    part, place = grid.part(low, high)
    box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    inside, outside = _sides(organ[box], np.clip(smooth[box], *prior.visible), prior, part)
    spacing = part.spacing_mm / part.factors
    coarse = np.transpose(part.full(organ[box]), part.order)
    values = np.transpose(volume.voxels[place], part.order).astype(np.float32)
    values = ndimage.gaussian_filter(np.clip(values, *prior.visible), _NOISE_MM / spacing)
    near = np.maximum(distance_inside(coarse, spacing), distance_inside(~coarse, spacing)) <= _BAND_MM
    fine = np.where(near, np.abs(values - inside) < np.abs(values - outside), coarse)
    fine = ndimage.gaussian_filter(fine.astype(np.float32), _RIPPLES_MM / spacing) >= 0.5
    whole = np.zeros(volume.grid.shape, dtype=bool)
    whole[place] = np.transpose(slices_filled(largest_part(fine)), np.argsort(part.order))
    return whole


def _sides(
    organ: NDArray[np.bool_], smooth: NDArray[np.float32], prior: IntensityPrior, part: WorkingGrid
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Mean grey value of the organ, and of what is not, about each of the scan's voxels (row, column, slice)."""
    means = []
    for side, unknown in ((organ, prior.mean), (~organ, prior.visible[0])):
        share = ndimage.gaussian_filter(side.astype(np.float32), _ABOUT_MM / part.spacing_mm)
        total = ndimage.gaussian_filter(np.where(side, smooth, np.float32(0.0)), _ABOUT_MM / part.spacing_mm)
        mean = np.where(share > _FEW, total / np.maximum(share, _FEW), np.float32(unknown))
        fine = ndimage.zoom(mean, part.factors, order=1, grid_mode=True, mode="nearest")
        a, b, c = part.shape
        means.append(fine[:a, :b, :c])
    return means[0], means[1]
