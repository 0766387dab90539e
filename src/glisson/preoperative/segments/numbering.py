"""Couinaud's numbers as a label map."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.image import LabelMap
from glisson.preoperative.segments.resections import SEGMENTS

CAUDATE_NUMBER = 1
SEGMENT_NAMES = {number: f"segment {number}" for number in SEGMENTS}
"""Names of the labels 1 to 8."""


def segment_map(organ: LabelMap, numbers: NDArray[np.integer]) -> LabelMap:
    """The label map of segments on the organ's grid; `numbers` (n,) are of the liver's voxels in their order."""
    voxels = np.zeros(organ.grid.shape, dtype=np.uint8)
    voxels[organ.mask("liver")] = numbers
    return LabelMap(voxels, organ.grid, SEGMENT_NAMES)
