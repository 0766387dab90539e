"""The organ from a label map that was given: another tool's, or a person's."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Grid, LabelMap, Volume
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, Segmentation, silent
from glisson.preoperative.imaging.axial import slice_axis
from glisson.preoperative.imaging.borders import touched_borders
from glisson.preoperative.imaging.components import Part, single_part

LARGEST_PINHOLE_ML = 1.0
"""Larger cavities are filled too, but a person should look at them."""


@dataclass(frozen=True)
class LabelSegmenterParameters:
    """Which label is the organ."""

    label: str = parameter("liver", "Name of the organ's label in the given label map.")


class LabelSegmenter:
    """Takes the organ's label, fills its cavities and takes off crumbs."""

    name: ClassVar[str] = "labels"
    summary: ClassVar[str] = "The organ from a given label map, in one part and without cavities."
    Parameters: ClassVar[type[LabelSegmenterParameters]] = LabelSegmenterParameters

    def __init__(self, parameters: LabelSegmenterParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def segment(
        self, volume: Volume, labels: LabelMap | None, seeds_mm: FloatArray, progress: Progress = silent
    ) -> Segmentation:
        """The organ ({1: "liver"}) as one part on the scan's grid; seeds are not used.

        Raises:
            BadInput: there are no labels, they lie on another grid, the organ's label is missing or
                empty, or the organ falls into parts.
        """
        if labels is None:
            raise BadInput(
                "The technique 'labels' needs a label map with the liver; give one, or use 'seeded-contour'."
            )
        if not volume.grid.matches(labels.grid):
            raise BadInput("The label map lies on another grid than the scan; resample it onto the scan's grid.")
        progress(0.0, "organ from labels")
        organ, crumbs = single_part(labels.mask(self._parameters.label), labels.grid, self._parameters.label)
        filled = ndimage.binary_fill_holes(organ)
        flags = _crumb_flags(crumbs, labels.grid) + _cavity_flags(filled & ~organ, labels.grid)
        flags += [(border.slice_near(labels.grid), border.sentence) for border in touched_borders(filled)]
        found = LabelMap(filled.astype(np.uint8), labels.grid, {1: "liver"})
        return Segmentation(found, tuple(sorted(flags)))


def _crumb_flags(crumbs: tuple[Part, ...], grid: Grid) -> list[tuple[int, str]]:
    axis = slice_axis(grid)
    if not crumbs:
        return []
    points = np.array([crumb.centroid_mm for crumb in crumbs])
    slices = np.rint(grid.indices_from_points(points)[:, axis]).astype(int)
    flags = []
    for k in np.unique(slices):
        here = [crumb for crumb, where in zip(crumbs, slices, strict=True) if where == k]
        more = "" if len(here) == 1 else f" and {len(here) - 1} more"
        flags.append((int(k), f"A separate crumb was removed: {here[0].place}{more}."))
    return flags


def _cavity_flags(cavities: NDArray[np.bool_], grid: Grid) -> list[tuple[int, str]]:
    numbered, count = ndimage.label(cavities)
    sizes = np.bincount(numbered.ravel(), minlength=count + 1)[1:] * grid.voxel_volume_mm3 * 1e-3
    flags = []
    for n in np.flatnonzero(sizes > LARGEST_PINHOLE_ML):
        centre = ndimage.center_of_mass(cavities, numbered, int(n) + 1)
        part = Part(float(sizes[n]), grid.points_from_indices(np.array([centre]))[0])
        flags.append((round(centre[slice_axis(grid)]), f"A cavity was filled: {part.place}."))
    return flags
