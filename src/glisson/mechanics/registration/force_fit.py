"""Gauss–Newton over the forces on a held body, with its compliance (Mestdagh and Cotin 2022)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.mechanics.registration.drawing import marginal, shift_cost, with_shift_prior, with_shifts
from glisson.mechanics.registration.outliers import cuts, judged
from glisson.mechanics.registration.pulled_body import Pulled, PulledBody
from glisson.mechanics.registration.rows import Rows
from glisson.mechanics.registration.seen import Seen

_ITERATIONS = 60
_STILL_MM = 0.1
"""A step that moves no place of the patch by more is the last."""

_LONGEST_MM = 15.0
_HALVINGS = 5
_LEAST = 1e-3  # variance of a way to move, as a share of the largest one's


@dataclass(frozen=True, eq=False)
class ForceFit:
    """A state at rest, what was seen there, the Hessian (3 b, 3 b) of the cost, and beliefs (p,) in the points.

    `shifts_mm` (q, 3) are those of the curves that were drawn.
    """

    state: Pulled
    shifts_mm: FloatArray
    rows: Rows
    hessian: FloatArray
    beliefs: FloatArray


@dataclass(frozen=True, eq=False)
class _Place:
    state: Pulled
    shifts_mm: FloatArray
    rows: Rows

    def cost(self, cut: FloatArray) -> float:
        return judged(self.rows, cut).cost + 0.5 * float((self.state.amounts**2).sum()) + shift_cost(self.shifts_mm)


def fit_forces(body: PulledBody, seen: Seen, start: Pulled) -> ForceFit:
    """The forces of least cost, each amount of unit variance, near to a state.

    What is not believed (Geman and McClure's function) is judged anew at every step.

    Raises:
        StageFailed: the organ does not come to rest.
    """
    here = _seen(body, seen, start, seen.as_drawn)
    for _ in range(_ITERATIONS):
        cut = cuts(here.rows, seen.item)
        judgement = judged(here.rows, cut)
        follows = body.follows(here.state)
        jacobian = with_shifts(_in_modes(body, here.rows) @ follows, here.rows, seen.curves)
        weighted = jacobian * judgement.weights[:, None]
        pull, prior = with_shift_prior(here.state.amounts.ravel(), np.eye(body.count), here.shifts_mm)
        hessian = weighted.T @ jacobian + prior
        step = cho_solve(cho_factor(hessian), weighted.T @ here.rows.residuals - pull)
        longest = float(np.linalg.norm(body.basis[body.patch] @ (follows @ step[: body.count]), axis=1).max())
        there = _lower(body, seen, here, min(1.0, _LONGEST_MM / longest) * step, cut) if longest > _STILL_MM else None
        if there is None:
            return ForceFit(here.state, here.shifts_mm, here.rows, marginal(hessian, body.count), judgement.beliefs)
        here = there
    raise StageFailed("The organ does not come to rest on what was seen.", Status.ITERATION_LIMIT)


def force_spread(body: PulledBody, found: ForceFit) -> FloatArray:
    """The ways to move (n, 3, k) that are not certain, each by one standard deviation."""
    follows = body.follows(found.state)
    covariance = follows @ cho_solve(cho_factor(found.hessian), follows.T)
    values, vectors = np.linalg.eigh(covariance)
    kept = values > _LEAST * values[-1]
    return body.fields(vectors[:, kept] * np.sqrt(values[kept]))


def _in_modes(body: PulledBody, rows: Rows) -> FloatArray:
    """Derivative (rows, r) of the whitened points, along the rows' directions, by the modal displacements."""
    pulled = rows.weights[:, :, None] * (rows.directions / rows.sigma_mm[:, None])[:, None]
    size = body.basis.shape[2]
    fields = body.basis[rows.nodes].reshape(len(rows.nodes), -1, size)
    result: FloatArray = np.matmul(pulled.reshape(len(fields), 1, -1), fields)[:, 0]
    return result


def _seen(body: PulledBody, seen: Seen, state: Pulled, shifts_mm: FloatArray) -> _Place:
    return _Place(state, shifts_mm, seen.rows(body.positions(state), shifts_mm))


def _lower(body: PulledBody, seen: Seen, here: _Place, step: FloatArray, cut: FloatArray) -> _Place | None:
    """Where a step, or a part of it, leads to less cost; None where none of them does."""
    cost = here.cost(cut)
    for _ in range(_HALVINGS):
        try:
            state, shifts = step[: body.count], step[body.count :].reshape(-1, 3)
            there = _seen(body, seen, body.moved(here.state, state), here.shifts_mm + shifts)
            if there.cost(cut) < cost:
                return there
        except StageFailed:
            pass
        step = 0.5 * step
    return None
