"""Axial slices of a mask that a person has drawn: the others follow, and the program says which to draw next."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from glisson.core.errors import BadInput
from glisson.core.image import Grid, Volume
from glisson.core.protocols import Progress, silent
from glisson.preoperative.correction.correcting import Correcting
from glisson.preoperative.correction.learned_outline import FEWEST_SLICES, learned_outline
from glisson.preoperative.imaging.axial import slice_axis

_MARGIN_MM = 10.0
"""Slices are cut to the masks and so much about them: farther no outline gets between two drawn ones."""


class DrawnSlices:
    """A mask some of whose slices were drawn.

    Args:
        automatic: the mask [i, j, k] before, not empty.
        drawn: a mask of the same shape that is right in some slices.
        numbers: the numbers of these slices along the scan's slice axis; None: all in which `drawn` has a voxel.
        grid: the scan's.

    Raises:
        BadInput: a mask is empty, or there is no slice of a number.
    """

    def __init__(
        self, automatic: NDArray[np.bool_], drawn: NDArray[np.bool_], numbers: Sequence[int] | None, grid: Grid
    ) -> None:
        self._automatic, self._drawn, self._axis = automatic, drawn, slice_axis(grid)
        slices = np.moveaxis(drawn, self._axis, 2)
        if numbers is None:
            numbers = np.flatnonzero(slices.any(axis=(0, 1))).tolist()
        for number in numbers:
            if not 0 <= number < slices.shape[2]:
                raise BadInput(f"There is no slice {number}; the scan's are 0 to {slices.shape[2] - 1}.")
        spacing = np.append(np.delete(grid.spacing_mm, self._axis), grid.spacing_mm[self._axis])
        whole = np.moveaxis(automatic, self._axis, 2)
        self._box = _box_of(np.any(whole | slices, axis=2), np.ceil(_MARGIN_MM / spacing).astype(int))
        self._correcting = Correcting(whole[self._box], spacing)
        for number in numbers:
            self._correcting.correct(number, slices[self._box][:, :, number])

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the drawn slices, in order."""
        return self._correcting.corrected

    def followed(self, volume: Volume, progress: Progress = silent) -> NDArray[np.bool_]:
        """The mask [i, j, k] whose slices have followed what the drawn ones teach about the scan; few teach shape only.

        Args:
            volume: the CT or MR, on the masks' grid.
            progress: told how far it is.
        """
        if len(self.numbers) < FEWEST_SLICES:
            return self.mask
        return learned_outline(volume, self._automatic, self._drawn, self.numbers, progress)

    @property
    def mask(self) -> NDArray[np.bool_]:
        """The mask [i, j, k] whose slices have followed the drawn ones by shape alone."""
        result = np.zeros_like(self._automatic)
        np.moveaxis(result, self._axis, 2)[self._box] = self._correcting.mask
        return result

    def suggested(self, count: int) -> tuple[int, ...]:
        """So many slices to draw next, the most useful first; the drawing itself could change the later ones."""
        correcting, found = self._correcting, []
        for _ in range(count):
            number = correcting.suggest()
            if number in correcting.corrected:
                break
            found.append(number)
            correcting.correct(number, correcting.mask[:, :, number])
        for _ in found:
            correcting.undo()
        return tuple(found)


def _box_of(plane: NDArray[np.bool_], margin: NDArray[np.int_]) -> tuple[slice, slice]:
    """The rectangle about a plane's pixels; all of it where there are none."""
    if not plane.any():
        return slice(None), slice(None)
    rows, columns = (np.flatnonzero(plane.any(axis=axis)) for axis in (1, 0))
    first, last = (
        slice(max(int(p[0] - m), 0), int(p[-1] + m + 1)) for p, m in zip((rows, columns), margin, strict=False)
    )
    return first, last
