"""The shape that all breaths share, and when each of them begins, is full and ends."""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import BSpline, PchipInterpolator
from scipy.optimize import least_squares
from scipy.sparse import csr_matrix

from glisson.core.arrays import FloatArray

PIECES = 20
"""Cubic pieces of a breath's shape."""

_ROUNDS, _EVALUATIONS = 3, 8
_INTO_NEXT = 0.5
"""So much of an inhalation after the last exhalation is fitted, too."""

_LEAST_PART, _FORBIDDEN = 0.02, 1e3
"""Knots keep this share of a period apart: nearer ones are given a misfit of so many depths."""

_FINE = np.linspace(0.0, 1.0, 1001)
_LOOKED_BACK = 700
"""So many thousandths of a breath before full inhalation it has begun."""


@dataclass(frozen=True, eq=False)
class Knots:
    """Full exhalations (k + 1,) and inhalations (k,) in s, and the depths of the breaths and levels they end at.

    While they are fitted there is one inhalation (and depth) more, after the last exhalation.
    """

    exhalations_s: FloatArray
    inhalations_s: FloatArray
    depths: FloatArray = field(default_factory=lambda: np.zeros(0))
    levels: FloatArray = field(default_factory=lambda: np.zeros(0))
    inhalation_phase: float = 0.4

    def phase(self, times_s: FloatArray) -> FloatArray:
        """Breaths since the first full exhalation, linear in time between the knots; NaN outside them."""
        return np.asarray(np.interp(times_s, *self.line, left=np.nan, right=np.nan))

    def moments(self, phase: FloatArray) -> FloatArray:
        """When a phase is reached (s); before the first knot and after the last as in the breath beside it."""
        at, values = self.line
        length, last = at[2] - at[0], at[-1] - at[-3]
        at = np.concatenate([at[:2] - length, at, at[-2:] + last])
        values = np.concatenate([values[:2] - 1.0, values, values[-2:] + 1.0])
        return np.asarray(np.interp(phase, values, at))

    @property
    def line(self) -> tuple[FloatArray, FloatArray]:
        """The knots' times and phases, one exhalation and one inhalation after the other."""
        exhalations, inhalations = len(self.exhalations_s), len(self.inhalations_s)
        at, values = np.zeros(exhalations + inhalations), np.zeros(exhalations + inhalations)
        at[0::2], at[1::2] = self.exhalations_s, self.inhalations_s
        values[0::2], values[1::2] = np.arange(exhalations), np.arange(inhalations) + self.inhalation_phase
        return at, values


def periodic_basis(phase: FloatArray, pieces: int = PIECES) -> FloatArray:
    """Cubic B-splines (n, pieces) that repeat with each breath."""
    knots = np.arange(-3.0, pieces + 4.0) / pieces
    values = BSpline.design_matrix(phase % 1.0, knots, 3).toarray()
    folded = values[:, :pieces].copy()
    folded[:, : values.shape[1] - pieces] += values[:, pieces:]
    return np.asarray(folded)


def fitted_knots(times_s: FloatArray, values: FloatArray, start: Knots) -> Knots:
    """Knots with which one shape, stretched in time and depth and put onto a drifting level, fits a signal best.

    The shape and the knots are fitted by turns. Full exhalation is where the shape begins to rise, full inhalation its
    greatest value: the shape of all breaths together knows these places much better than one breath does.
    """
    levels = np.interp(start.exhalations_s, times_s, values)
    depths = np.interp(start.inhalations_s, times_s, values) - 0.5 * (levels[1:] + levels[:-1])
    into = start.inhalations_s - start.exhalations_s[:-1]
    share = float(np.clip((into / np.diff(start.exhalations_s)).mean(), 0.1, 0.9))
    # When an exhalation has ended is told by the rise after it, of the last one, too.
    knots = Knots(
        start.exhalations_s,
        np.append(start.inhalations_s, start.exhalations_s[-1] + into.mean()),
        np.append(depths, depths.mean()),
        levels,
        share,
    )
    end = start.exhalations_s[-1] + _INTO_NEXT * into.mean()
    inside = (times_s >= start.exhalations_s[0]) & (times_s <= end)
    times, values = times_s[inside], values[inside]
    for _ in range(_ROUNDS):
        shape = _shape(knots, times, values)
        knots = _moved(knots, shape, times, values)
        knots = _anchored(knots, _shape(knots, times, values))
    whole = len(knots.exhalations_s) - 1
    return replace(knots, inhalations_s=knots.inhalations_s[:whole], depths=knots.depths[:whole])


def _level(knots: Knots, times: FloatArray) -> FloatArray:
    inside = np.minimum(times, knots.exhalations_s[-1])
    return np.asarray(PchipInterpolator(knots.exhalations_s, knots.levels)(inside))


def _depth(knots: Knots, phase: FloatArray) -> FloatArray:
    return knots.depths[np.clip(phase.astype(np.int64), 0, len(knots.depths) - 1)]


def _shape(knots: Knots, times: FloatArray, values: FloatArray) -> FloatArray:
    """Coefficients (PIECES,) of the shape, from 0 at full exhalation."""
    phase = np.interp(times, *knots.line)
    basis = periodic_basis(phase) - periodic_basis(np.zeros(1))
    design = _depth(knots, phase)[:, None] * basis
    # A constant more in all pieces changes nothing: the least of all solutions has none.
    return np.asarray(np.linalg.lstsq(design, values - _level(knots, times), rcond=1e-9)[0])


def _moved(knots: Knots, shape: FloatArray, times: FloatArray, values: FloatArray) -> Knots:
    """The knots moved, and depths and levels changed, so that the shape fits best."""
    exhalations, inhalations = len(knots.exhalations_s), len(knots.inhalations_s)
    ends = np.cumsum([exhalations, inhalations, inhalations, exhalations])
    period, scale = float(np.mean(np.diff(knots.exhalations_s))), float(np.mean(knots.depths))
    start = periodic_basis(np.zeros(1))

    def made(parameters: FloatArray) -> Knots:
        out, into, depths, levels = np.split(parameters, ends[:-1])
        return replace(
            knots,
            exhalations_s=knots.exhalations_s + period * out,
            inhalations_s=knots.inhalations_s + period * into,
            depths=knots.depths + scale * depths,
            levels=knots.levels + scale * levels,
        )

    def off(parameters: FloatArray) -> FloatArray:
        changed = made(parameters)
        if (np.diff(changed.line[0]) < _LEAST_PART * period).any():
            return np.full(len(times), _FORBIDDEN * scale)
        # A frame beside the first or last breath stays with it while the knots move.
        phase = np.interp(times, *changed.line)
        fit = (periodic_basis(phase) - start) @ shape
        return np.asarray(_level(changed, times) + _depth(changed, phase) * fit - values)

    sparsity = _sparsity(knots, times)
    found = least_squares(off, np.zeros(ends[-1]), jac_sparsity=sparsity, max_nfev=_EVALUATIONS)
    return made(found.x)


def _sparsity(knots: Knots, times: FloatArray) -> csr_matrix:
    """Which frames (n) each parameter can change: those of the breaths beside it."""
    inhalations, exhalations = len(knots.inhalations_s), len(knots.exhalations_s)
    breath = np.clip(np.searchsorted(knots.exhalations_s, times, side="right") - 1, 0, inhalations - 1)
    own = np.abs(breath[:, None] - np.arange(inhalations)[None, :]) <= 1
    ends = breath[:, None] - np.arange(exhalations)[None, :]
    near, wide = (ends >= -2) & (ends <= 1), (ends >= -3) & (ends <= 2)
    return csr_matrix(np.hstack([near, own, own, wide]).astype(np.int8))


def _anchored(knots: Knots, shape: FloatArray) -> Knots:
    """The same breaths with full exhalation where the shape begins to rise, and full inhalation at its top.

    It rises as the square of the time at first, so that the place follows from where it is through 2.5 and 10 %. Its
    least value, in the long flat end of an exhalation, is anybody's guess.
    """
    values = (periodic_basis(_FINE) - periodic_basis(np.zeros(1))) @ shape
    top = int(np.argmax(values))
    before = np.arange(top - _LOOKED_BACK, top + 1)
    rise = values[before % (len(_FINE) - 1)]
    floor = rise.min()
    shares = (rise - floor) / (values[top] - floor)
    through = [_last_below(shares, level) for level in (0.025, 0.1)]
    low = 1e-3 * (before[0] + 2.0 * through[0] - through[1])
    high = 1e-3 * top
    exhalations = np.arange(len(knots.exhalations_s), dtype=np.float64)
    return replace(
        knots,
        exhalations_s=knots.moments(exhalations + low),
        inhalations_s=knots.moments(exhalations[: len(knots.inhalations_s)] + high),
        inhalation_phase=high - low,
    )


def _last_below(shares: FloatArray, level: float) -> float:
    """Where, as an index with a fraction, values pass a level for the last time on their way up."""
    n = int(np.flatnonzero(shares < level)[-1])
    return n + float((level - shares[n]) / (shares[n + 1] - shares[n]))
