"""A segmentation that a person corrects slice by slice, while the slices between follow."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.preoperative.correction.shape_blending import Correction, blended_slice, neighbours

_FIRST = 20
"""One slice of so many is spread over the organ before others are chosen by what these showed …"""

_LEAST = 3
""" … and at least."""

_UNSEEN = 0.03
"""Of a slice's area that is taken to be wrong even where corrections found nothing wrong."""

_BEYOND = 4
"""Slices beyond the organ's automatic ends in which it may go on."""


class Correcting:
    """Corrected slices, what they make of the others, which one to look at next, and the way back.

    Args:
        automatic: the mask (row, column, slice).
        spacing_mm: voxel spacing (3,).

    Raises:
        BadInput: the mask is empty.
    """

    def __init__(self, automatic: NDArray[np.bool_], spacing_mm: FloatArray) -> None:
        if not automatic.any():
            raise BadInput("There is nothing to correct: the mask is empty.")
        self._automatic, self._spacing = automatic, np.asarray(spacing_mm, dtype=np.float64)
        self._mask = automatic.copy()
        self._corrections: dict[int, Correction] = {}
        self._wrong: dict[int, int] = {}
        self._before: list[tuple[int, Correction | None]] = []

    @property
    def mask(self) -> NDArray[np.bool_]:
        """The mask (row, column, slice) as it is now; a copy."""
        return self._mask.copy()

    @property
    def corrected(self) -> tuple[int, ...]:
        """Numbers of the corrected slices, in order."""
        return tuple(sorted(self._corrections))

    def correct(self, number: int, mask: NDArray[np.bool_]) -> None:
        """Take a slice (row, column) as true; an empty one says that the organ is not in it.

        Raises:
            BadInput: there is no such slice, or the shape is another one.
        """
        shape = self._automatic.shape
        if not 0 <= number < shape[2] or mask.shape != shape[:2]:
            raise BadInput(f"Slice {number} with {mask.shape} pixels does not fit a scan of {shape} voxels.")
        self._before.append((number, self._corrections.get(number)))
        # Only a slice that is corrected for the first time tells how well the others foresaw it.
        if number not in self._corrections:
            self._wrong[number] = int((self._mask[:, :, number] ^ mask).sum())
        made = Correction.of(number, self._automatic[:, :, number], mask, self._spacing[:2])
        self._corrections[number] = made
        self._renew(number)

    def undo(self) -> bool:
        """Take the last correction back; false where there is none."""
        if not self._before:
            return False
        number, correction = self._before.pop()
        if correction is None:
            del self._corrections[number]
        else:
            self._corrections[number] = correction
        self._renew(number)
        return True

    def suggest(self) -> int:
        """The slice to look at next: first some that are spread evenly, then the one in which most may be wrong.

        What is wrong between corrections is taken to grow with the distance to the nearer one, and with what was wrong
        in these slices when they were corrected.
        """
        organ = np.flatnonzero(self._automatic.any(axis=(0, 1)))
        first, last = int(organ[0]), int(organ[-1])
        count = max(round((last + 1 - first) / _FIRST), _LEAST)
        if len(self._corrections) < count:
            places = first + (np.arange(count) + 0.5) * (last + 1 - first) / count
            return next(int(place) for place in places if int(place) not in self._corrections)
        numbers = range(max(first - _BEYOND, 0), min(last + 1 + _BEYOND, self._automatic.shape[2]))
        open_ones = [number for number in numbers if number not in self._corrections]
        return max(open_ones, key=self._expected_error, default=first)

    def _expected_error(self, number: int) -> float:
        near = neighbours(self._corrections, number)
        apart = min(abs(correction.number - number) for correction in near)
        seen = np.mean([self._wrong[correction.number] for correction in near])
        return float(apart * (seen + _UNSEEN * self._mask[:, :, number].sum()))

    def _renew(self, number: int) -> None:
        """Make the slices anew for which a correction of this one counts."""
        low = max((k for k in self._corrections if k < number), default=-1)
        high = min((k for k in self._corrections if k > number), default=self._automatic.shape[2])
        for k in range(low + 1, high):
            near = neighbours(self._corrections, k)
            if k in self._corrections:
                self._mask[:, :, k] = self._corrections[k].target < 0.0
            elif near:
                self._mask[:, :, k] = blended_slice(self._automatic[:, :, k], k, near, self._spacing)
            else:
                self._mask[:, :, k] = self._automatic[:, :, k]
