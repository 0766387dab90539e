"""Least squares over cameras and poses, which are moved by small steps rather than added to."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status

State = TypeVar("State")

_ITERATIONS = 300
_LEAST_GAIN = 1e-10
_MOST_DAMPING = 1e8
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
    state, here, damping, growth = start, equations_at(start), 1e-4, 2.0
    for _ in range(_ITERATIONS):
        scale = np.diag(here.matrix) + 1e-12 * np.trace(here.matrix)
        try:
            step = cho_solve(cho_factor(here.matrix + damping * np.diag(scale)), -here.gradient)
        except LinAlgError:
            damping, growth = damping * growth, 2.0 * growth
            continue
        tried = moved(state, step)
        there = equations_at(tried)
        if there.cost < here.cost:
            gain = here.cost - there.cost
            promised = 0.5 * float(step @ (damping * scale * step - here.gradient))
            # The damping falls by as much as the equations kept their promise (Nielsen 1999).
            damping, growth = damping * max(1.0 / 3.0, 1.0 - (2.0 * gain / promised - 1.0) ** 3), 2.0
            settled = gain < _LEAST_GAIN * here.cost
            state, here = tried, there
            if settled:
                return Minimum(state, here)
        elif damping > _MOST_DAMPING:
            return Minimum(state, here)  # no step is short enough to gain anything
        else:
            damping, growth = damping * growth, 2.0 * growth
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
