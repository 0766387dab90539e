"""What another program took for the liver, made an organ in one part."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.image import LabelMap, Volume
from glisson.core.protocols import Segmentation
from glisson.core.status import Status
from glisson.preoperative.liver.label_segmenter import LabelSegmenter, LabelSegmenterParameters

_NO_CLICKS: FloatArray = np.zeros((0, 3))


def cleaned_liver(volume: Volume, found: NDArray[np.bool_], labels: LabelMap | None, program: str) -> Segmentation:
    """The liver with the tumours that are known, cleaned and flagged as a label map that was given is.

    Args:
        volume: the scan.
        found: the program's mask (i, j, k) on the scan's grid.
        labels: tumours that are known already.
        program: its name, for the sentence.

    Raises:
        BadInput: it falls into parts, or the labels lie on another grid.
        StageFailed: it is empty.
    """
    if not found.any():
        raise StageFailed(f"{program} found no liver in the scan.", Status.STAGNATED)
    cleaner = LabelSegmenter(LabelSegmenterParameters())
    if labels is not None and volume.grid.matches(labels.grid):
        found = found | labels.mask(*(name for name in labels.names.values() if name.startswith("tumour")))
    return cleaner.segment(volume, LabelMap(found.astype(np.uint8), volume.grid, {1: "liver"}), _NO_CLICKS)
