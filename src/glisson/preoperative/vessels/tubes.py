"""What the ways to find tubes in an organ share: cubic voxels about it, bright tubes, and no crumbs at the end."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.image import LabelMap, Volume
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.preoperative.vessels.isotropic import IsotropicBox


@dataclass(frozen=True)
class TubeParameters:
    """Which tubes are looked for, and in what voxels."""

    tubes: str = parameter("bright", "Vessels with contrast agent, or ducts.", choices=("bright", "dark"))
    resolution_mm: float = parameter(1.0, "Voxels are resampled to this size, mm.", 0.3, 3.0)
    smallest_mm3: float = parameter(300.0, "Smaller pieces are left out, mm³.", 0.0, 1e6)


P = TypeVar("P", bound=TubeParameters)


class TubeSegmenter(ABC, Generic[P]):
    """A way to find bright tubes; dark ones are bright in the negative."""

    def __init__(self, parameters: P) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def find(self, volume: Volume, organ: LabelMap, progress: Progress = silent) -> LabelMap:
        """Tubes inside the organ, {1: "vessel"} on the scan's grid.

        Raises:
            BadInput: the organ's mask is empty.
        """
        chosen = self._parameters
        progress(0.0, "resampling")
        inside = organ.mask("liver")
        box = IsotropicBox.around(inside, volume.grid, chosen.resolution_mm)
        within, values = box.mask(inside), box.values(volume.voxels)
        found = self._tubes(values if chosen.tubes == "bright" else -values, within, progress) & within
        found = without_crumbs(found, chosen.smallest_mm3, chosen.resolution_mm)
        return LabelMap((box.back(found) & inside).astype(np.uint8), volume.grid, {1: "vessel"})

    @abstractmethod
    def _tubes(self, values: NDArray[np.float32], within: NDArray[np.bool_], progress: Progress) -> NDArray[np.bool_]:
        """Voxels [i, j, k] of bright tubes, from grey values in cubic voxels and the organ's mask there."""


def without_crumbs(mask: NDArray[np.bool_], smallest_mm3: float, size_mm: float) -> NDArray[np.bool_]:
    """The parts of a mask (touching by corners, too) that are not smaller than this."""
    numbered, _ = ndimage.label(mask, structure=np.ones((3, 3, 3)))
    sizes = np.bincount(numbered.ravel()) * size_mm**3
    sizes[0] = 0.0
    kept: NDArray[np.bool_] = mask & (sizes[numbered] >= smallest_mm3)
    return kept
