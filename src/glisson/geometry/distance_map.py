"""Distances inside a mask, on all cores (Maurer, Qi, Raghavan, IEEE Trans. Pattern Anal. 25:265, 2003)."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray


def distance_inside(mask: NDArray[np.bool_], spacing_mm: FloatArray) -> NDArray[np.float32]:
    """Distance in mm of each voxel of a mask to the nearest voxel outside, 0 outside; exact.

    Args:
        mask: 2-D or 3-D.
        spacing_mm: one number for each axis.

    Returns:
        Same shape as the mask; infinite everywhere where nothing is outside.
    """
    import SimpleITK as sitk  # slow to load, and `--help` needs this module

    if mask.all():
        return np.full(mask.shape, np.inf, dtype=np.float32)
    # The filter measures from the border voxels of what is set: what lies outside of the mask is.
    outside = sitk.GetImageFromArray((~mask).view(np.uint8))
    outside.SetSpacing([float(step) for step in spacing_mm[::-1]])
    signed = sitk.SignedMaurerDistanceMap(outside, insideIsPositive=False, squaredDistance=False, useImageSpacing=True)
    distance: NDArray[np.float32] = np.maximum(sitk.GetArrayFromImage(signed), 0.0)
    return distance
