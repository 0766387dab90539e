"""Points that do not belong, told by Geman and McClure's function (1987)."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.registration.rows import Rows

_CUT = 3.0
CUTS = (8.0 * _CUT, 4.0 * _CUT, 2.0 * _CUT, _CUT)
"""Beyond so many standard deviations points count less and less, one fit after another: a far start finds its way."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """How much each observed point counts (p,), 0 to 1, and what all of them cost."""

    weights: FloatArray
    cost: float


def judged(rows: Rows, count: int, cut: float) -> Judgement:
    """The cost of `count` observed points and the weights at which least squares have the same gradient."""
    squares = rows.squares(count)
    may_lie = np.bincount(rows.point, rows.robust, minlength=count) > 0.0
    share = 1.0 / (1.0 + squares / cut**2)
    return Judgement(np.where(may_lie, share**2, 1.0), 0.5 * float(np.where(may_lie, squares * share, squares).sum()))
