"""What the ways to mark a structure share: each click gives a piece, and the pieces together are judged."""

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import LabelMap, Volume
from glisson.core.protocols import MarkedStructure, Progress, silent
from glisson.preoperative.imaging.scan_checks import require_hu
from glisson.preoperative.structures.kinds import Kind, kind_of
from glisson.preoperative.structures.metal import metal_about
from glisson.preoperative.structures.parameters import StructureParameters
from glisson.preoperative.structures.plausible import doubts, require_plausible
from glisson.preoperative.structures.soft import SoftPiece, soft_piece


class StructureMarker(ABC):
    """A way to mark a structure by clicks."""

    Parameters: ClassVar[type[StructureParameters]] = StructureParameters

    def __init__(self, parameters: StructureParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def mark(
        self, volume: Volume, organ: LabelMap | None, name: str, seeds_mm: FloatArray, progress: Progress = silent
    ) -> MarkedStructure:
        """Mark a structure; see `glisson.core.protocols.StructureSegmenter`."""
        kind = kind_of(name)
        points = np.asarray(seeds_mm, dtype=np.float64).reshape(-1, 3)
        if not len(points):
            raise BadInput(f"Where the {kind.noun} lies must be said by a click; give --seed-point X,Y,Z (LPS mm).")
        require_hu(volume)
        liver = None if organ is None else organ.mask("liver")
        mask, reach = (np.zeros(volume.grid.shape, dtype=bool) for _ in range(2))
        for number, point in enumerate(points):
            progress(number / len(points), f"click {number + 1} of {len(points)}")
            place, piece = self._piece(volume, liver, kind, point)
            mask[place] |= piece
            reach[place] = True
        require_plausible(mask, volume.grid, kind, liver)
        apart = len(points) > 1 and not kind.is_metal and int(ndimage.label(mask)[1]) > 1
        notes = doubts(mask, volume, kind, liver, reach, apart)
        return MarkedStructure(LabelMap(mask.astype(np.uint8), volume.grid, {1: name}), notes)

    def _piece(
        self, volume: Volume, liver: NDArray[np.bool_] | None, kind: Kind, point_mm: FloatArray
    ) -> tuple[tuple[slice, ...], NDArray[np.bool_]]:
        """A block of the scan and what one click marks in it."""
        chosen = self._parameters
        if kind.is_metal:
            return metal_about(volume, kind, point_mm, chosen.reach_mm, chosen.gap_mm)
        found = soft_piece(volume, liver, kind, point_mm, chosen)
        return found.block.place, self._refined(found)

    @abstractmethod
    def _refined(self, piece: SoftPiece) -> NDArray[np.bool_]:
        """The mask of soft tissue that the technique makes of what the threshold gave."""
