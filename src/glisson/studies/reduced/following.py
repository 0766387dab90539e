"""Follows loads that come on live, and compares where they end with full solutions."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.protocols import Progress, silent
from glisson.mechanics.reduced.live import LiveModel
from glisson.mechanics.reduced.load import Load

UPDATES = 20
"""In which a load comes on from rest; 170 a second would bring it on in an eighth of a second."""


@dataclass(frozen=True, eq=False)
class Followed:
    """Answers to loads (k,): end positions (k, n, 3), bounds (k,) in mm, seconds and fall-backs of updates (k, u)."""

    positions: FloatArray
    bounds_mm: FloatArray
    seconds: FloatArray
    fell_back: NDArray[np.bool_]


def follow(live: LiveModel, loads: Sequence[Load], progress: Progress = silent) -> Followed:
    """Bring every load on from rest in `UPDATES` updates."""
    seconds, fell_back = np.zeros((len(loads), UPDATES)), np.zeros((len(loads), UPDATES), dtype=bool)
    ends, bounds = [], []
    for number, load in enumerate(loads):
        progress(number / len(loads), f"load {number + 1} of {len(loads)}")
        live.reset()
        for step in range(UPDATES):
            part = load.part((step + 1) / UPDATES)
            start = time.perf_counter()
            update = live.update(part)
            seconds[number, step] = time.perf_counter() - start
            fell_back[number, step] = update.fell_back
        ends.append(update.positions)
        bounds.append(update.bound_mm)
    return Followed(np.array(ends), np.array(bounds), seconds, fell_back)
