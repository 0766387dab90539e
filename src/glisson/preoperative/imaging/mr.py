"""An MR as segmentation looks at it: signal that means nothing by itself, on a scale like a CT's.

The coil's uneven sensitivity is taken out (N4, Tustison et al. 2010, IEEE TMI 29:1310, in SimpleITK). Then the tissue
that was clicked gets a liver's HU, and what is brighter or darker a value in proportion. What has little signal, as
fat with its signal suppressed, air and bone, gets that of fat.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.filters import threshold_otsu

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Volume
from glisson.preoperative.imaging.diffusion import smoothed
from glisson.preoperative.imaging.surroundings import Index, distance_from
from glisson.preoperative.imaging.working_grid import WorkingGrid

_LIVER_HU, _FAT_HU = 110.0, -100.0
_HU_PER_FRACTION = 130.0
"""Signal that is brighter than the liver's by its tenth gets 13 HU more: organs are then as far apart as in a CT."""

_LITTLE = 0.38
"""Signal below this fraction of the liver's is none of a soft organ."""

_AIR = 0.15
"""Signal below this fraction of the body's median is noise; no sequence shows a liver so dark without iron in it."""

_LOOK_MM = 10.0
"""The liver's signal is the median of so much about the clicks."""

_COARSE_MM = 8.0
_ITERATIONS = (20, 10)
_CONTROL_POINTS = 5
"""The field is smooth over some 70 mm, so it is fitted to coarse voxels."""


def smoothed_mr(volume: Volume, grid: WorkingGrid, clicks: Sequence[Index]) -> NDArray[np.float32]:
    """Smoothed values of an MR on the working grid (row, column, slice), on the scale of HU.

    Args:
        volume: an MR.
        grid: the working grid.
        clicks: working voxels inside the liver, at least one.

    Raises:
        BadInput: a click lies in air.
    """
    uneven = grid.working(volume.voxels)
    near = [distance_from(click, uneven.shape, grid.spacing_mm) <= _LOOK_MM for click in clicks]
    _refuse_air(near, ndimage.gaussian_filter(uneven, 1.5 / grid.spacing_mm))
    even = _without_bias(uneven, grid.spacing_mm)
    calm = ndimage.gaussian_filter(even, 1.5 / grid.spacing_mm)
    signal = max(float(np.median(np.concatenate([calm[place] for place in near]))), 1e-6)
    values = _LIVER_HU + _HU_PER_FRACTION * (even / signal - 1.0)
    scaled = np.where(calm < _LITTLE * signal, _FAT_HU, values).astype(np.float32)
    return smoothed(scaled, grid.spacing_mm)


def _refuse_air(near: Sequence[NDArray[np.bool_]], calm: NDArray[np.float32]) -> None:
    """Refuse clicks whose surroundings have hardly any of the body's signal; an estimated field is wild in air."""
    body = float(np.median(calm[calm >= threshold_otsu(calm)]))
    for place in near:
        if (signal := float(np.median(calm[place]))) <= _AIR * body:
            raise BadInput(
                f"A click lies in air: the signal there is {100.0 * signal / max(body, 1e-6):.0f} % of the body's; "
                "click inside the liver."
            )


def _without_bias(values: NDArray[np.float32], spacing_mm: FloatArray) -> NDArray[np.float32]:
    """Signal (a, b, c) over the coil's sensitivity, which is 1 on average."""
    import SimpleITK as sitk  # slow to load, and `--help` needs this module

    image = sitk.GetImageFromArray(values.T)  # SimpleITK counts the slowest axis first
    image.SetSpacing(spacing_mm.tolist())
    factors = [min(max(round(_COARSE_MM / s), 1), n) for s, n in zip(spacing_mm, values.shape, strict=True)]
    coarse = sitk.Shrink(image, factors)
    tissue = sitk.OtsuThreshold(coarse, 0, 1)
    fit = sitk.N4BiasFieldCorrectionImageFilter()
    fit.SetMaximumNumberOfIterations(_ITERATIONS)
    fit.SetNumberOfControlPoints([_CONTROL_POINTS] * 3)
    fit.Execute(coarse, tissue)
    field = sitk.GetArrayFromImage(fit.GetLogBiasFieldAsImage(image)).T
    even: NDArray[np.float32] = (values / np.exp(field)).astype(np.float32)
    return even
