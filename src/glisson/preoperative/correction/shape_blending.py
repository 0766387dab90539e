"""What corrected slices tell of a slice between them, by blending signed distances.

Between two corrected slices their signed distances, blended, say what the outline may be; the automatic outline, moved
by the blend of what the corrections moved it by, says what it is. The second is kept as far as it does not leave the
first by more than an outline bends on the way: so an error that two corrections show on both sides is mended between
them, and one that none shows is held in check.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.preoperative.contours.signed_distance import signed_distance_of_mask

_BEND = 0.8
"""How far an outline may lie from the blend of the corrected ones, for each mm to the nearer of them …"""

_LEAST_BEND_MM = 1.5
""" … and at least."""

_FADE_MM = 15.0
"""Beyond the outermost corrected slices a correction is forgotten over this distance."""

_FARTHEST_MM = 30.0
"""Distances are cut there: what has no outline is as far from one as that."""


@dataclass(frozen=True, eq=False)
class Correction:
    """Signed distances (row, column) in mm of a corrected slice, and how it differs from the automatic one."""

    number: int
    target: FloatArray
    move: FloatArray

    @classmethod
    def of(
        cls, number: int, automatic: NDArray[np.bool_], corrected: NDArray[np.bool_], spacing_mm: FloatArray
    ) -> "Correction":
        """The correction of an automatic slice (row, column); spacing (2,) of rows and columns."""
        target = _distance(corrected, spacing_mm)
        return cls(number, target, target - _distance(automatic, spacing_mm))


def neighbours(corrections: Mapping[int, Correction], number: int) -> list[Correction]:
    """The nearest correction below a slice and the nearest above, as far as there are any."""
    below = [k for k in corrections if k < number]
    above = [k for k in corrections if k > number]
    found = ([max(below)] if below else []) + ([min(above)] if above else [])
    return [corrections[k] for k in found]


def blended_slice(
    automatic: NDArray[np.bool_], number: int, near: list[Correction], spacing_mm: FloatArray
) -> NDArray[np.bool_]:
    """A slice (row, column) as its automatic mask and one or two corrected neighbours have it.

    Args:
        automatic: the slice's automatic mask.
        number: of the slice.
        near: its `neighbours`.
        spacing_mm: of rows, columns and slices (3,).
    """
    apart = spacing_mm[2] * np.abs(np.array([correction.number for correction in near]) - number)
    phi = _distance(automatic, spacing_mm[:2])
    if len(near) == 1:
        alone: NDArray[np.bool_] = phi + max(1.0 - apart[0] / _FADE_MM, 0.0) * near[0].move < 0.0
        return alone
    share = apart[0] / apart.sum()
    blend = (1.0 - share) * near[0].target + share * near[1].target
    moved = phi + (1.0 - share) * near[0].move + share * near[1].move
    bend = max(_BEND * float(apart.min()), _LEAST_BEND_MM)
    inside: NDArray[np.bool_] = np.clip(moved, blend - bend, blend + bend) < 0.0
    return inside


def _distance(mask: NDArray[np.bool_], spacing_mm: FloatArray) -> FloatArray:
    if not mask.any():
        return np.full(mask.shape, _FARTHEST_MM)
    if mask.all():
        return np.full(mask.shape, -_FARTHEST_MM)
    return np.clip(signed_distance_of_mask(mask, spacing_mm), -_FARTHEST_MM, _FARTHEST_MM)
