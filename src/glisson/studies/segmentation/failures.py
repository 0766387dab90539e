"""Failures of a segmentation, put into a good one: what a contour does wrong, drawn from a seed.

- leak: in a run of slices the contour has gone on into a neighbour that touches the organ, by 8 mm more from slice to
  slice and up to 20 to 30 mm, as `preoperative.liver.propagation` lets it;
- shrunken: in a run of slices it has stayed 6 to 10 mm inside;
- missing tumour: a tumour is left out with what little tissue covers it;
- shifted: one slice lies 8 to 15 mm beside its place;
- empty: one slice has nothing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside

KINDS = ("leak", "shrunken", "missing tumour", "shifted", "empty")

_RUN = (3, 9)
"""A run has at least so many slices, and fewer than so many."""

_MIDDLE = (0.15, 0.85)
"""Failures lie in this part of the organ's height."""

_LEAK_STEP_MM, _LEAK_MM = 8.0, (20.0, 30.0)
_TOUCHING_MM = 3.0
_INSIDE_MM = (6.0, 10.0)
_COVER_MM = 4.0
_BESIDE_MM = (8.0, 15.0)
_SHARE, _LEAST_MM2 = 0.05, 100.0
"""A slice has failed where so much of its area, and at least so much, is wrong."""


@dataclass(frozen=True, eq=False)
class Failure:
    """A spoilt mask (row, column, slice) with the slices that have failed, and those that are as good as before."""

    mask: NDArray[np.bool_]
    failed: frozenset[int]
    good: frozenset[int]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What failures need: neighbours and tumours as masks (row, column, slice), and the spacing (3,) in mm."""

    neighbours: Sequence[NDArray[np.bool_]]
    tumours: Sequence[NDArray[np.bool_]]
    spacing_mm: FloatArray


def spoilt(kind: str, mask: NDArray[np.bool_], around: Surroundings, random: np.random.Generator) -> Failure | None:
    """A good mask with one failure; None where there is no place for it."""
    make = {"leak": _leaking, "shrunken": _shrunken, "missing tumour": _without_tumour, "shifted": _shifted}
    found = _emptied(mask, random) if kind == "empty" else make[kind](mask, around, random)
    if found is None:
        return None
    pixel = float(np.prod(around.spacing_mm[:2]))
    wrong = (found ^ mask).sum(axis=(0, 1)) * pixel
    areas = mask.sum(axis=(0, 1)) * pixel
    failed = np.flatnonzero(wrong >= np.maximum(_SHARE * areas, _LEAST_MM2))
    good = np.flatnonzero((wrong == 0.0) & (areas > 0.0))
    return Failure(found, frozenset(failed.tolist()), frozenset(good.tolist())) if len(failed) else None


def _leaking(mask: NDArray[np.bool_], around: Surroundings, random: np.random.Generator) -> NDArray[np.bool_] | None:
    near = distance_inside(~mask, around.spacing_mm) <= _TOUCHING_MM
    touching = [neighbour & ~mask for neighbour in around.neighbours if (neighbour & near & ~mask).any()]
    if not touching:
        return None
    neighbour = touching[int(random.integers(len(touching)))]
    places = np.argwhere(neighbour & near)
    place = places[int(random.integers(len(places)))]
    reach = random.uniform(*_LEAK_MM)
    found, count = mask.copy(), int(random.integers(*_RUN))
    first = int(place[2]) - count // 2
    for n, k in enumerate(range(first, first + count)):
        if 0 <= k < mask.shape[2] and mask[:, :, k].any():
            goes = min(_LEAK_STEP_MM * min(n + 1, count - n), reach)
            found[:, :, k] |= neighbour[:, :, k] & (_away(place[:2], mask.shape[:2], around.spacing_mm) <= goes)
    return found


def _away(place: NDArray[np.int_], shape: tuple[int, ...], spacing_mm: FloatArray) -> FloatArray:
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    away: FloatArray = np.hypot((rows - place[0]) * spacing_mm[0], (columns - place[1]) * spacing_mm[1])
    return away


def _shrunken(mask: NDArray[np.bool_], around: Surroundings, random: np.random.Generator) -> NDArray[np.bool_]:
    found, by, count = mask.copy(), random.uniform(*_INSIDE_MM), int(random.integers(*_RUN))
    first = _any_slice(mask, random)
    for k in range(first, min(first + count, mask.shape[2])):
        found[:, :, k] = distance_inside(mask[:, :, k], around.spacing_mm[:2]) > by
    return found


def _without_tumour(
    mask: NDArray[np.bool_], around: Surroundings, random: np.random.Generator
) -> NDArray[np.bool_] | None:
    if not around.tumours:
        return None
    tumour = around.tumours[int(random.integers(len(around.tumours)))]
    kept: NDArray[np.bool_] = distance_inside(~tumour, around.spacing_mm) > _COVER_MM
    return mask & kept


def _shifted(mask: NDArray[np.bool_], around: Surroundings, random: np.random.Generator) -> NDArray[np.bool_]:
    found, k = mask.copy(), _any_slice(mask, random)
    angle, by = random.uniform(0.0, 2.0 * np.pi), random.uniform(*_BESIDE_MM)
    move = by * np.array([np.cos(angle), np.sin(angle)]) / around.spacing_mm[:2]
    found[:, :, k] = ndimage.shift(mask[:, :, k], np.rint(move), order=0)
    return found


def _emptied(mask: NDArray[np.bool_], random: np.random.Generator) -> NDArray[np.bool_]:
    found = mask.copy()
    found[:, :, _any_slice(mask, random)] = False
    return found


def _any_slice(mask: NDArray[np.bool_], random: np.random.Generator) -> int:
    slices = np.flatnonzero(mask.any(axis=(0, 1)))
    low, high = (int(slices[0] + share * (slices[-1] - slices[0])) for share in _MIDDLE)
    return int(random.integers(low, high + 1))
