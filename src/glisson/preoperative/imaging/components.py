"""Connected parts of masks, and what they enclose: one organ is one part."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Grid
from glisson.core.units import place_text

LARGEST_CRUMB = 0.01
"""A second part above this fraction of the largest one is no crumb but a question for a person."""


@dataclass(frozen=True, eq=False)
class Part:
    """A face-connected part of a mask: its volume and centroid (LPS mm)."""

    volume_ml: float
    centroid_mm: FloatArray

    @property
    def place(self) -> str:
        """Volume and centroid for people."""
        return f"{_volume_text(self.volume_ml)} at {place_text(self.centroid_mm)}"


def largest_part(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The largest face-connected part of a mask; empty where that is."""
    numbered, count = ndimage.label(mask)
    if count == 0:
        return mask
    largest: NDArray[np.bool_] = numbered == int(np.argmax(np.bincount(numbered.ravel())[1:])) + 1
    return largest


def slices_filled(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A mask (row, column, slice) with all that it encloses in a slice."""
    return np.stack([ndimage.binary_fill_holes(mask[:, :, k]) for k in range(mask.shape[2])], axis=2)


def single_part(mask: NDArray[np.bool_], grid: Grid, what: str) -> tuple[NDArray[np.bool_], tuple[Part, ...]]:
    """The largest face-connected part of a mask [i, j, k], and the crumbs that were taken off it.

    Raises:
        BadInput: the mask is empty, or a second part has more than 1 % of the largest one's volume.
    """
    if not mask.any():
        raise BadInput(f"The mask of {what!r} is empty; check the label's name or segment again.")
    numbered, count = ndimage.label(mask)
    if count == 1:
        return mask, ()
    sizes = np.bincount(numbered.ravel())[1:]
    order = np.argsort(-sizes, kind="stable")
    centroids = ndimage.center_of_mass(mask, numbered, order + 1)
    parts = [
        Part(float(sizes[n]) * grid.voxel_volume_mm3 * 1e-3, grid.points_from_indices(np.array([centre]))[0])
        for n, centre in zip(order, centroids, strict=True)
    ]
    large = [part for part in parts if part.volume_ml > LARGEST_CRUMB * parts[0].volume_ml]
    if len(large) > 1:
        places = "; ".join(part.place for part in large[:4])
        raise BadInput(f"{what!r} has {len(large)} separate parts ({places}); keep one or join them in the label map.")
    return numbered == order[0] + 1, tuple(parts[1:])


def _volume_text(volume_ml: float) -> str:
    return f"{volume_ml:.0f} ml" if volume_ml >= 10.0 else f"{volume_ml:.2g} ml"
