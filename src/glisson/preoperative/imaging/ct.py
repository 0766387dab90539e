"""A CT as segmentation looks at it: without the extremes of air and bone, smoothed up to its edges."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.image import Volume
from glisson.preoperative.imaging.diffusion import smoothed
from glisson.preoperative.imaging.scan_checks import require_hu
from glisson.preoperative.imaging.working_grid import WorkingGrid

VISIBLE_HU = (-300.0, 400.0)
"""Air and bone are cut to this range before smoothing."""


def smoothed_ct(volume: Volume, grid: WorkingGrid) -> NDArray[np.float32]:
    """Smoothed HU of a CT on the working grid (row, column, slice).

    Raises:
        BadInput: its values are no HU.
    """
    require_hu(volume)
    return smoothed(grid.working(np.clip(volume.voxels, *VISIBLE_HU)), grid.spacing_mm)
