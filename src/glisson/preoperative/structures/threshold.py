"""Structures by a threshold about the click, the first of the dissertation's two ways (section 4.3)."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from glisson.preoperative.structures.marker import StructureMarker
from glisson.preoperative.structures.soft import SoftPiece


class ThresholdStructure(StructureMarker):
    """Grey values as at the click, without what is reached by narrow passages only."""

    name: ClassVar[str] = "threshold"
    summary: ClassVar[str] = (
        "Grey values up to half-way to the tissue about the click; of metal what is thin and bright."
    )

    def _refined(self, piece: SoftPiece) -> NDArray[np.bool_]:
        return piece.mask
