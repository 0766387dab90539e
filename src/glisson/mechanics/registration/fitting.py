"""Gauss–Newton over a motion: what was seen pulls at material points, which are found anew at every step."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.mechanics.registration.motion import Motion, MotionState
from glisson.mechanics.registration.outliers import CUTS, judged
from glisson.mechanics.registration.rows import Rows
from glisson.mechanics.registration.seen import Seen

_ITERATIONS = 200
_AT_REST = 1e-5
"""A step that promises to lower half the sum of squares by less than this is nothing beside its noise, which is 1."""

_LONGEST_MM = 15.0


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the organ came to rest.

    Args:
        state: of the motion.
        rows: what was seen, there.
        weights: (p,) how much each observed point counts, 0 to 1.
        data, prior: Hessians (size, size) of what was seen and of the motion's own cost.
        gradient: (size,) of the cost.
        cost: half the sum of all squares.
    """

    state: MotionState
    rows: Rows
    weights: FloatArray
    data: FloatArray
    prior: FloatArray
    gradient: FloatArray
    cost: float


def fit(motion: Motion, seen: Seen, start: MotionState, told: Callable[[int], None] = lambda step: None) -> Fit:
    """The state that explains what was seen at the least cost (Geman and McClure's function for outliers).

    Raises:
        StageFailed: it does not come to rest, or nothing holds the organ.
    """
    state = start
    for cut in CUTS:
        found = _descend(motion, seen, state, cut, told)
        state = found.state
    return found


def _descend(motion: Motion, seen: Seen, state: MotionState, cut: float, told: Callable[[int], None]) -> Fit:
    damping = 1e-6
    here = _at(motion, seen, state, cut)
    for step_number in range(_ITERATIONS):
        told(step_number)
        matrix = here.data + here.prior
        scale = np.diag(matrix) + 1e-9 * np.trace(matrix) / len(matrix)
        try:
            step = cho_solve(cho_factor(matrix + damping * np.diag(scale)), -here.gradient)
        except LinAlgError:
            damping = max(10.0 * damping, 1e-6)
            continue
        length = _length(step)
        step *= min(1.0, _LONGEST_MM / max(length, 1e-12))
        if -float(here.gradient @ step) < _AT_REST and length < _LONGEST_MM:
            return here
        there = _at(motion, seen, motion.moved(here.state, step), cut)
        if there.cost < here.cost:
            settled = here.cost - there.cost < _AT_REST
            damping, here = max(damping / 5.0, 1e-9), there
            if settled:
                return here
        elif damping < 1e6:
            damping *= 5.0
        else:
            return here
    raise StageFailed("The organ does not come to rest on what was seen.", Status.ITERATION_LIMIT)


def _at(motion: Motion, seen: Seen, state: MotionState, cut: float) -> Fit:
    rows = seen.rows(motion.positions(state))
    judgement = judged(rows, seen.count, cut)
    own, pull, prior = motion.prior(state)
    jacobian = _jacobian(motion, state, rows)
    weighted = jacobian * judgement.weights[rows.point, None]
    gradient = pull - weighted.T @ rows.residuals
    return Fit(state, rows, judgement.weights, weighted.T @ jacobian, prior, gradient, judgement.cost + own)


def _jacobian(motion: Motion, state: MotionState, rows: Rows) -> FloatArray:
    """Derivative (r, size) of the whitened points, along the rows' directions."""
    nodes, places = np.unique(rows.nodes, return_inverse=True)
    moves = motion.derivative(state, nodes)
    pulled = np.einsum("ra,raik->rik", rows.weights, moves[places.reshape(rows.nodes.shape)])
    jacobian: FloatArray = np.einsum("ri,rik->rk", rows.directions / rows.sigma_mm[:, None], pulled)
    return jacobian


def _length(step: FloatArray) -> float:
    """How far a step moves the nodes at most, roughly (mm)."""
    return float(np.linalg.norm(step[:6])) + (float(np.abs(step[6:]).max()) if len(step) > 6 else 0.0)
