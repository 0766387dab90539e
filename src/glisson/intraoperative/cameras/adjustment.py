"""Least squares over cameras and poses, which are moved by small steps rather than added to."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.core.damping import Damping
from glisson.core.errors import StageFailed
from glisson.core.status import Status

State = TypeVar("State")

_ITERATIONS = 300
_LEAST_GAIN = 1e-10
_SINGULAR = 1e-13


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """What is minimised at a state: half of the sum of squares, its gradient (n,) and JᵀJ (n, n)."""

    cost: float
    gradient: FloatArray
    matrix: FloatArray


@dataclass(frozen=True, eq=False)
class Minimum(Generic[State]):
    """The state with the least sum of squares, and the normal equations there."""

    state: State
    equations: NormalEquations


def minimum(
    start: State, equations_at: Callable[[State], NormalEquations], moved: Callable[[State, FloatArray], State]
) -> Minimum[State]:
    """The minimum nearest to `start`, by Levenberg's and Marquardt's method (Marquardt 1963).

    Args:
        start: where to begin.
        equations_at: the normal equations at a state; an infinite cost where a state is impossible.
        moved: a state moved by a step (n,).

    Raises:
        StageFailed: it does not come to rest.
    """
    state, here, damping = start, equations_at(start), Damping()
    for _ in range(_ITERATIONS):
        extra = damping.share * (np.diag(here.matrix) + 1e-12 * np.trace(here.matrix))
        try:
            step = cho_solve(cho_factor(here.matrix + np.diag(extra)), -here.gradient)
        except LinAlgError:
            damping.raised()
            continue
        tried = moved(state, step)
        there = equations_at(tried)
        gain = here.cost - there.cost
        if gain > 0.0:
            damping.eased(gain, 0.5 * float(step @ (extra * step - here.gradient)))
            settled = gain < _LEAST_GAIN * here.cost
            state, here = tried, there
            if settled:
                return Minimum(state, here)
        elif not damping.raised():
            return Minimum(state, here)
    raise StageFailed(
        "Poses and points could not be brought together; check what was given, or take more views.",
        Status.ITERATION_LIMIT,
    )


def inverse(matrix: FloatArray) -> FloatArray | None:
    """The inverse of normal equations (n, n), or None where some direction is not determined.

    Unknowns of all units are brought to one scale first.
    """
    diagonal = np.diag(matrix)
    if not (np.isfinite(matrix).all() and (diagonal > 0.0).all()):
        return None
    scale = 1.0 / np.sqrt(diagonal)
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    if values[0] < _SINGULAR * values[-1]:
        return None
    result: FloatArray = (vectors / values) @ vectors.T * np.outer(scale, scale)
    return result
