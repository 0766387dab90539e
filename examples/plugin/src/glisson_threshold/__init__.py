"""A segmenter in a package of its own: grey values in a window, and of those the part that was clicked."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import ndimage

from glisson.core import BadInput, LabelMap, StageFailed, Status, Volume
from glisson.core.arrays import FloatArray
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, Segmentation, silent


@dataclass(frozen=True)
class ThresholdParameters:
    """From these the options --segment.lowest-hu and so on are made, and their lines in case.toml."""

    lowest_hu: float = parameter(80.0, "Least grey value of the liver (HU).", -1000.0, 3000.0)
    highest_hu: float = parameter(180.0, "Largest grey value of the liver (HU).", -1000.0, 3000.0)
    opening_mm: float = parameter(3.0, "Bridges thinner than twice this are cut.", 0.0, 20.0)


class Threshold:
    """Threshold, morphological opening, and the part at the click (without one the largest)."""

    name: ClassVar[str] = "threshold"
    summary: ClassVar[str] = "Grey values in a window, and of those the part that was clicked."
    Parameters: ClassVar[type[ThresholdParameters]] = ThresholdParameters

    def __init__(self, parameters: ThresholdParameters) -> None:
        if parameters.lowest_hu >= parameters.highest_hu:
            raise BadInput(f"lowest_hu must lie below highest_hu, not at {parameters.lowest_hu}.")
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        return ()

    def segment(
        self, volume: Volume, labels: LabelMap | None, seeds_mm: FloatArray, progress: Progress = silent
    ) -> Segmentation:
        wanted = self._parameters
        progress(0.0, "threshold")
        smooth = ndimage.median_filter(volume.voxels, 3)
        inside = (smooth >= wanted.lowest_hu) & (smooth <= wanted.highest_hu)
        spacing = volume.grid.spacing_mm
        core = ndimage.distance_transform_edt(inside, sampling=spacing) > wanted.opening_mm
        parts, count = ndimage.label(core)
        if count == 0:
            raise StageFailed("No voxel has the liver's grey values; widen lowest_hu and highest_hu.", Status.STAGNATED)
        chosen = parts == self._clicked_part(parts, volume, seeds_mm)
        grown = ndimage.distance_transform_edt(~chosen, sampling=spacing) <= wanted.opening_mm
        liver = ndimage.binary_fill_holes(grown & inside)
        return Segmentation(LabelMap(liver.astype(np.uint8), volume.grid, {1: "liver"}))

    def _clicked_part(self, parts: np.ndarray, volume: Volume, seeds_mm: FloatArray) -> int:
        if len(seeds_mm) == 0:
            return int(np.bincount(parts.ravel())[1:].argmax()) + 1
        i, j, k = np.rint(volume.grid.indices_from_points(seeds_mm)[0]).astype(int)
        shape = np.array(parts.shape)
        part = parts[i, j, k] if ((np.array([i, j, k]) >= 0) & (np.array([i, j, k]) < shape)).all() else 0
        if part == 0:
            raise BadInput("The click does not lie inside a part of the liver's grey values; click elsewhere.")
        return int(part)
