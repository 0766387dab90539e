"""Clicks applied to a mask on the scan's own grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.errors import BadInput
from glisson.core.image import Volume
from glisson.core.units import place_text
from glisson.preoperative.correction.clicks import with_piece, without_piece
from glisson.preoperative.imaging.clicked import checked_clicks
from glisson.preoperative.imaging.ct import smoothed_ct
from glisson.preoperative.imaging.working_grid import WorkingGrid

_RESOLUTION_MM = 1.6

_MARGIN = 4
"""Working voxels about what changed that are looked at, for the interpolation."""


@dataclass(frozen=True)
class Click:
    """A place (x, y, z), LPS mm, and whether the organ should be there."""

    point_mm: tuple[float, float, float]
    is_organ: bool


class ClickedMask:
    """An organ's mask that follows clicks; what no click concerns stays voxel for voxel as it was.

    Args:
        volume: a CT (HU).
        mask: the organ (i, j, k) on the CT's grid, not empty.

    Raises:
        BadInput: the scan is not a CT.
    """

    def __init__(self, volume: Volume, mask: NDArray[np.bool_]) -> None:
        if volume.modality != "CT":
            raise BadInput("Clicks need a CT, since they go by HU; correct the label map in a label editor instead.")
        self._scan, self._grid = volume.grid, WorkingGrid.of(volume.grid, _RESOLUTION_MM)
        self._smooth = smoothed_ct(volume, self._grid)
        self._kept: list[tuple[int, int, int]] = []
        self._mask = mask.copy()

    @property
    def mask(self) -> NDArray[np.bool_]:
        """The mask (i, j, k) as it is now; a copy."""
        return self._mask.copy()

    def apply(self, click: Click) -> None:
        """Add or take away what was clicked.

        Raises:
            BadInput: the click lies outside the scan, says what is so already, or would take away all that there is;
                the mask stays as it was.
        """
        point = np.array(click.point_mm, dtype=np.float64)
        where, place = place_text(point), self._grid.working_index(checked_clicks(self._scan, point[None])[0])
        before = self._grid.working(self._mask) >= 0.5
        if bool(before[place]) == click.is_organ:
            there = "inside" if click.is_organ else "outside"
            raise BadInput(f"The click {where} lies {there} the organ already.")
        spacing = self._grid.spacing_mm
        if click.is_organ:
            after = with_piece(self._smooth, before, spacing, place)
            self._kept.append(place)
        else:
            after = without_piece(before, spacing, place, self._kept)
            if not after.any():
                raise BadInput(f"The click {where} would take away all of the organ.")
        self._take_over(before ^ after, after)

    def _take_over(self, changed: NDArray[np.bool_], after: NDArray[np.bool_]) -> None:
        """Put what changed on the working grid into the mask; all else stays, since the working mask is coarser."""
        if not changed.any():
            return
        found = ndimage.find_objects(changed.astype(np.uint8))[0]
        low = [max(extent.start - _MARGIN, 0) for extent in found]
        high = [min(extent.stop + _MARGIN, count) for extent, count in zip(found, changed.shape, strict=True)]
        box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        part, place = self._grid.part(low, high)
        # A voxel about what changed belongs to its border.
        concerned = part.full(ndimage.binary_dilation(changed[box]))
        self._mask[place] = np.where(concerned, part.full(after[box]), self._mask[place])
