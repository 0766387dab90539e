"""Observations that cannot be true together, or not of this organ."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.observations import Observation, Observations
from glisson.mechanics.registration.drawing import DRAWN_MM
from glisson.mechanics.registration.rows import Rows
from glisson.mechanics.registration.seen import Seen

_DOUBTED = 3.0
"""How many times further off than expected, in its median point, an observation is that does not fit."""

_MOST_LEFT_OUT = 8
"""Of so many observations each is left out in turn: it takes a whole registration."""

_MOST_TOLD = 4


def misfits(seen: Seen, rows: Rows, shifts_mm: FloatArray) -> tuple[str, ...]:
    """What does not fit where the organ has come to rest, each with how far it is off.

    Args:
        seen: all that was seen.
        rows: of it, there.
        shifts_mm: (q, 3) of the curves that were drawn.
    """
    count = len(seen.item)
    squares, gaps = rows.squares(count), np.zeros(count)
    np.add.at(gaps, rows.point, rows.gaps_mm**2)
    told, rows_each = [], np.bincount(rows.point, minlength=count)
    for number, label in enumerate(seen.labels):
        mine = seen.item == number
        expected = chi2.median(rows_each[mine].min())
        drawn = _drawn_off(rows, mine, shifts_mm)
        if np.median(squares[mine]) > _DOUBTED**2 * expected or drawn > _DOUBTED * DRAWN_MM * np.sqrt(chi2.median(3)):
            told.append(f"{label} by {np.hypot(np.sqrt(np.median(gaps[mine])), drawn):.0f} mm")
    return tuple(told)


def _drawn_off(rows: Rows, mine: NDArray[np.bool_], shifts_mm: FloatArray) -> float:
    """How far the curve (mm) was shifted on which some points (p,) lie; 0 where they lie on none."""
    curve = int(rows.curve[mine[rows.point]][0])
    return float(np.linalg.norm(shifts_mm[curve])) if curve >= 0 else 0.0


def contradiction(observations: Observations, off: tuple[str, ...], fits: Callable[[Observations], bool]) -> str | None:
    """A sentence on what does not fit, and without which observation the rest does.

    Args:
        observations: all.
        off: what does not fit; see `misfits`.
        fits: whether some of them fit together.
    """
    if not off:
        return None
    items = [item for item in observations.items if len(item.points_mm)]
    few = 1 < len(items) <= _MOST_LEFT_OUT
    liars = [item for item in items if _fits_without(observations, item, fits)] if few else []
    told = [*off[:_MOST_TOLD], *([f"{len(off) - _MOST_TOLD} more"] if len(off) > _MOST_TOLD else [])]
    sentence = f"What was seen does not fit together: {', '.join(told)} off after the best fit."
    if liars:
        names = " or ".join(f"{item.kind} {item.name!r}" for item in liars)
        return f"{sentence} Without {names} the rest fits."
    return f"{sentence} Is it of this organ?"


def _fits_without(observations: Observations, item: Observation, fits: Callable[[Observations], bool]) -> bool:
    rest = Observations(tuple(other for other in observations.items if other is not item))
    try:
        return fits(rest)
    except StageFailed:
        return False
