"""Gauss–Newton over a motion: what was seen pulls at material points, which are found anew at every step."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.core.damping import Damping
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.mechanics.registration.drawing import marginal, shift_cost, with_shift_prior, with_shifts
from glisson.mechanics.registration.motion import Motion, MotionState
from glisson.mechanics.registration.outliers import cuts, judged, narrowing
from glisson.mechanics.registration.rest import Rest
from glisson.mechanics.registration.rows import Rows
from glisson.mechanics.registration.seen import Seen

_ITERATIONS = 200
_AT_REST = 1e-4
_LONGEST = 15.0


@dataclass(frozen=True, eq=False)
class Fit:
    """Where the organ came to rest.

    Args:
        state: of the motion.
        shifts_mm: (q, 3) of the curves that were drawn.
        rows: what was seen, there.
        beliefs: (p,) how far each observed point is believed, 0 to 1.
        hessian: (size, size) of the cost, whatever the shifts are.
        gradient: (size,) of the cost.
        cost: half the sum of all squares.
    """

    state: MotionState
    shifts_mm: FloatArray
    rows: Rows
    beliefs: FloatArray
    hessian: FloatArray
    gradient: FloatArray
    cost: float


def fit(motion: Motion, seen: Seen, start: MotionState) -> Fit:
    """The state that explains what was seen at the least cost (Geman and McClure's function for outliers).

    Raises:
        StageFailed: it does not come to rest, or nothing holds the organ.
    """
    drawn = seen.as_drawn
    begun = _at(motion, seen, start, drawn, cuts(seen.rows(motion.positions(start), drawn), seen.item))
    found = narrowing(begun, lambda fit: fit.rows, seen.item, lambda fit, cut: _descend(motion, seen, fit, cut))
    return replace(found, hessian=marginal(found.hessian, motion.size), gradient=found.gradient[: motion.size])


def _descend(motion: Motion, seen: Seen, begun: Fit, cut: FloatArray) -> Fit:
    rest = Rest(_AT_REST)
    here, damping = _at(motion, seen, begun.state, begun.shifts_mm, cut), Damping()
    for _ in range(_ITERATIONS):
        extra = damping.share * (np.diag(here.hessian) + 1e-9 * np.trace(here.hessian) / len(here.hessian))
        try:
            step = cho_solve(cho_factor(here.hessian + np.diag(extra)), -here.gradient)
        except LinAlgError:
            damping.raised()
            continue
        share = min(1.0, _LONGEST / max(_length(step[: motion.size]), 1e-12))
        there = _stepped(motion, seen, here, share * step, cut)
        gained = here.cost - there.cost
        if gained > 0.0:
            damping.eased(gained, 0.5 * share * float(step @ (extra * step - here.gradient)))
            here = there
            if rest.reached(here.cost):
                return here
        elif not damping.raised():
            return here
    raise StageFailed("The organ does not come to rest on what was seen.", Status.ITERATION_LIMIT)


def _stepped(motion: Motion, seen: Seen, here: Fit, step: FloatArray, cut: FloatArray) -> Fit:
    state, shifts = step[: motion.size], step[motion.size :]
    return _at(motion, seen, motion.moved(here.state, state), here.shifts_mm + shifts.reshape(-1, 3), cut)


def _at(motion: Motion, seen: Seen, state: MotionState, shifts_mm: FloatArray, cut: FloatArray) -> Fit:
    """The cost there, its gradient and Hessian by all unknowns, the shifts last."""
    rows = seen.rows(motion.positions(state), shifts_mm)
    judgement = judged(rows, cut)
    own, pull, prior = motion.prior(state)
    pull, prior = with_shift_prior(pull, prior, shifts_mm)
    jacobian = with_shifts(_jacobian(motion, state, rows), rows, seen.curves)
    weighted = jacobian * judgement.weights[:, None]
    gradient, hessian = pull - weighted.T @ rows.residuals, weighted.T @ jacobian + prior
    cost = judgement.cost + own + shift_cost(shifts_mm)
    return Fit(state, shifts_mm, rows, judgement.beliefs, hessian, gradient, cost)


def _jacobian(motion: Motion, state: MotionState, rows: Rows) -> FloatArray:
    """Derivative (r, size) of the whitened points, along the rows' directions."""
    nodes, places = np.unique(rows.nodes, return_inverse=True)
    moves = motion.derivative(state, nodes)
    pulled = np.einsum("ra,raik->rik", rows.weights, moves[places.reshape(rows.nodes.shape)])
    jacobian: FloatArray = np.einsum("ri,rik->rk", rows.directions / rows.sigma_mm[:, None], pulled)
    return jacobian


def _length(step: FloatArray) -> float:
    """How large a step is: how far it moves the nodes as one piece (mm), and the largest amount of its modes."""
    return float(np.linalg.norm(step[:6])) + (float(np.abs(step[6:]).max()) if len(step) > 6 else 0.0)
