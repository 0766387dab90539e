"""Points that do not belong, told by Geman and McClure's function (1987)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.registration.rows import Rows

_CUT = 3.0
_NORMAL = 1.4826  # standard deviations of a normal distribution in a median of its absolute values
_NARROWER = 0.8
_ROUNDS = 8


State = TypeVar("State")


@dataclass(frozen=True, eq=False)
class Judgement:
    """How far each observed point is believed (p,), 0 to 1, how much each row counts (r,), and what all rows cost."""

    beliefs: FloatArray
    weights: FloatArray
    cost: float


def judged(rows: Rows, cut: FloatArray) -> Judgement:
    """The cost of the observed points and the weights at which least squares have the same gradient.

    Args:
        rows: of what was seen.
        cut: (p,) standard deviations beyond which each point counts less and less.
    """
    count = len(cut)
    may_lie, worth = np.zeros(count, dtype=np.bool_), np.zeros(count)
    may_lie[rows.point], worth[rows.point] = rows.robust, rows.worth
    squares = rows.squares(count)
    share = 1.0 / (1.0 + squares / cut**2)
    beliefs = np.where(may_lie, share**2, 1.0)
    cost = 0.5 * float(worth @ np.where(may_lie, squares * share, squares))
    return Judgement(beliefs, beliefs[rows.point] * rows.worth, cost)


def cuts(rows: Rows, item: IntArray) -> FloatArray:
    """So many standard deviations (p,) beyond which points are doubted.

    They are counted in what the points of the same observation `item` (p,) are off by their median: a feature that is
    off as a whole is no outlier but still has to come.
    """
    squares = rows.squares(len(item))
    off = np.array([np.sqrt(np.median(squares[item == number])) for number in range(item.max() + 1)])
    widths: FloatArray = _CUT * np.maximum(_NORMAL * off, 1.0)[item]
    return widths


def narrowing(
    start: State, rows_of: Callable[[State], Rows], item: IntArray, descend: Callable[[State, FloatArray], State]
) -> State:
    """Descents, each with narrower cuts than the one before, until they are as narrow as they will be.

    Args:
        start: where to begin.
        rows_of: what was seen, against a state.
        item: (p,) the observation of each observed point.
        descend: from a state to the one of least cost, with cuts (p,).
    """
    state, cut = start, cuts(rows_of(start), item)
    for _ in range(_ROUNDS):
        state = descend(state, cut)
        narrower = np.minimum(cut, cuts(rows_of(state), item))
        if (narrower > _NARROWER * cut).all():
            break
        cut = narrower
    return state
