"""The rate of ventilation from which on faster strokes no longer make the tissue move less."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import f as f_distribution

from glisson.core.arrays import FloatArray
from glisson.core.status import Status
from glisson.intraoperative.breathing.displacement import Displacement

_ORDER = 3
_STEP_HZ = 0.005
_REPEATS = 0.02
"""Standard deviation, as a share, with which a displacement comes out again when a recording is repeated."""

_CONFIDENCE = 0.9
_LEAST_RATES = _ORDER + 5
_LEAST_ABOVE = 2
_FALLS = 3.0
"""The slowest rate's displacement must lie so many standard deviations above the plateau, or there is no fall."""


@dataclass(frozen=True)
class Plateau:
    """Where the displacement stops falling.

    Args:
        status: unobservable where the rates that could be resolved do not show it.
        sentence: what a person should know.
        rate_hz: the lowest rate from which on it is constant; None where that is not to be seen.
        interval_hz: 90 % interval of that.
        displacement: on the plateau, in the unit of the tracks.
        rates_hz: (g,) and
        curve: (g,) the fitted curve.
    """

    status: Status
    sentence: str
    rate_hz: float | None = None
    interval_hz: tuple[float, float] | None = None
    displacement: float | None = None
    rates_hz: FloatArray | None = None
    curve: FloatArray | None = None


def find_plateau(displacements: Sequence[Displacement]) -> Plateau:
    """Fit of a broken curve: constant from the break on, a cubic in the logarithm of the rate below it.

    The interval is that of the profile likelihood (the break being the only parameter that is not linear). Recordings
    that could not resolve their rate are left out.
    """
    used = sorted((d for d in displacements if d.status.is_good), key=lambda d: d.rate_hz)
    left_out = len(displacements) - len(used)
    told = f" ({left_out} rates that the recording cannot resolve are left out)" if left_out else ""
    rates = np.array([d.rate_hz for d in used])
    if len(np.unique(rates)) < _LEAST_RATES:
        return Plateau(
            Status.UNOBSERVABLE,
            f"{_LEAST_RATES} different rates are needed, {len(np.unique(rates))} can be used{told}.",
        )
    values = np.array([d.value for d in used])
    variance = np.array([d.sigma**2 for d in used]) + (_REPEATS * values) ** 2
    weights = 1.0 / np.sqrt(np.maximum(variance, 1e-12))
    breaks = np.arange(rates[1], rates[-_LEAST_ABOVE] + 0.5 * _STEP_HZ, _STEP_HZ)
    fits = [_fit(rates, values, weights, at) for at in breaks]
    misfits = np.array([misfit for misfit, _ in fits])
    best = int(np.argmin(misfits))
    found, coefficients = float(breaks[best]), fits[best][1]
    freedom = len(rates) - _ORDER - 2
    scale = max(1.0, misfits[best] / freedom)
    likely = breaks[misfits <= misfits[best] + scale * f_distribution.ppf(_CONFIDENCE, 1, freedom)]
    level = float(coefficients[0])
    falls = (values[0] - level) * weights[0] > _FALLS * np.sqrt(scale)
    if not np.isfinite(misfits[best]) or not falls:
        return Plateau(Status.UNOBSERVABLE, f"The displacement does not fall with the rate{told}.")
    if likely[-1] > breaks[-1] - 0.5 * _STEP_HZ:
        return Plateau(
            Status.UNOBSERVABLE,
            f"The displacement may still fall at {rates[-1]:g} Hz, the fastest rate that can be used{told}.",
        )
    fine = np.linspace(rates[0], rates[-1], 400)
    return Plateau(
        Status.CONVERGED,
        f"From {found:.1f} Hz ({60.0 * found:.0f} per minute; 90 % interval {likely[0]:.1f} to {likely[-1]:.1f} Hz) on "
        f"the displacement is constant{told}.",
        found,
        (float(likely[0]), float(likely[-1])),
        level,
        fine,
        _design(fine, found) @ coefficients,
    )


def _fit(rates: FloatArray, values: FloatArray, weights: FloatArray, at: float) -> tuple[float, FloatArray]:
    """Weighed sum of squares and coefficients with the break at a rate; infinite where the curve rises to it."""
    design = _design(rates, at)
    coefficients = np.linalg.lstsq(design * weights[:, None], values * weights, rcond=None)[0]
    off = (design @ coefficients - values) * weights
    return (float(off @ off) if coefficients[1] > 0.0 else np.inf), np.asarray(coefficients, dtype=np.float64)


def _design(rates: FloatArray, at: float) -> FloatArray:
    below = np.maximum(np.log(at / rates), 0.0)
    return np.column_stack([below**power for power in range(_ORDER + 1)])
