"""Points that do not belong, told by Geman and McClure's function (1987)."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.registration.rows import Rows

_CUT = 3.0
_WIDEST = 20.0 * _CUT
_NORMAL = 1.4826  # standard deviations of a normal distribution in a median of its absolute values


@dataclass(frozen=True, eq=False)
class Judgement:
    """How far each observed point is believed (p,), 0 to 1, how much each row counts (r,), and what all rows cost."""

    beliefs: FloatArray
    weights: FloatArray
    cost: float


def judged(rows: Rows, count: int, cut: float) -> Judgement:
    """The cost of `count` observed points and the weights at which least squares have the same gradient."""
    squares = rows.squares(count)
    may_lie = np.bincount(rows.point, rows.robust, minlength=count) > 0.0
    share = 1.0 / (1.0 + squares / cut**2)
    beliefs = np.where(may_lie, share**2, 1.0)
    worth = np.ones(count)
    worth[rows.point] = rows.worth
    cost = 0.5 * float(worth @ np.where(may_lie, squares * share, squares))
    return Judgement(beliefs, beliefs[rows.point] * rows.worth, cost)


def cuts(rows: Rows, count: int) -> list[float]:
    """So many standard deviations beyond which points count less and less, one fit after another.

    The first is as wide as what was seen is off from the start, by its median, so that a far start finds its way and
    points that lie are left aside from the beginning.
    """
    off = _NORMAL * float(np.sqrt(np.median(rows.squares(count))))
    halvings = int(np.ceil(np.log2(np.clip(_CUT * off, _CUT, _WIDEST) / _CUT)))
    return [_CUT * 2.0**halving for halving in range(halvings, -1, -1)]
