"""Follows loads that come on live, and compares where they end with full solutions."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.live import LiveModel
from glisson.mechanics.reduced.load import Load

UPDATES = 40
"""In which a load comes on from rest; at 170 a second that takes a quarter of a second."""


@dataclass(frozen=True, eq=False)
class Followed:
    """Answers to loads (k,): end positions (k, n, 3), their bounds (k,) in mm, which are the full model's (k,).

    `seconds` and `fell_back` (k, `UPDATES`) are those of every update.
    """

    positions: FloatArray
    bounds_mm: FloatArray
    raw_mm: FloatArray
    seconds: FloatArray
    fell_back: NDArray[np.bool_]

    def part(self, chosen: NDArray[np.bool_]) -> "Followed":
        """Some of the loads."""
        return Followed(*(getattr(self, field.name)[chosen] for field in fields(self)))


def follow(live: LiveModel, loads: Sequence[Load]) -> Followed:
    """Bring every load on from rest in `UPDATES` updates."""
    seconds, fell_back = np.zeros((len(loads), UPDATES)), np.zeros((len(loads), UPDATES), dtype=bool)
    ends, bounds, raw = [], [], []
    for number, load in enumerate(loads):
        live.reset()
        for step in range(UPDATES):
            part = load.part((step + 1) / UPDATES)
            start = time.perf_counter()
            update = live.update(part)
            seconds[number, step] = time.perf_counter() - start
            fell_back[number, step] = update.fell_back
        ends.append(update.positions)
        bounds.append(update.bound_mm)
        raw.append(update.raw_mm)
    return Followed(np.array(ends), np.array(bounds), np.array(raw), seconds, fell_back)


def joined(parts: Sequence[Followed]) -> Followed:
    """All loads of some parts."""
    return Followed(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Followed)))
