"""Gauss–Newton over the forces on a held body, with its compliance (Mestdagh and Cotin 2022)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.mechanics.registration.outliers import cuts, judged
from glisson.mechanics.registration.pulled_body import Pulled, PulledBody
from glisson.mechanics.registration.rows import Rows
from glisson.mechanics.registration.seen import Seen

_ITERATIONS = 60
_STILL_MM = 0.1
_LONGEST_MM = 15.0
_HALVINGS = 5
_LEAST = 1e-3  # variance of a way to move, as a share of the largest one's


@dataclass(frozen=True, eq=False)
class ForceFit:
    """A state at rest, what was seen there, the Hessian (3 b, 3 b) of the cost, and beliefs (p,) in the points."""

    state: Pulled
    rows: Rows
    hessian: FloatArray
    beliefs: FloatArray


@dataclass(frozen=True, eq=False)
class _Place:
    state: Pulled
    rows: Rows

    def cost(self, cut: FloatArray) -> float:
        return judged(self.rows, cut).cost + 0.5 * float((self.state.amounts**2).sum())


def fit_forces(body: PulledBody, seen: Seen, start: Pulled) -> ForceFit:
    """The forces of least cost, each amount of unit variance, near to a state.

    What is not believed (Geman and McClure's function) is judged anew at every step.

    Raises:
        StageFailed: the organ does not come to rest.
    """
    here = _seen(body, seen, start)
    for _ in range(_ITERATIONS):
        cut = cuts(here.rows, seen.item)
        judgement = judged(here.rows, cut)
        follows = body.follows(here.state)
        jacobian = _in_modes(body, here.rows) @ follows
        weighted = jacobian * judgement.weights[:, None]
        hessian = weighted.T @ jacobian + np.eye(body.count)
        gradient = weighted.T @ here.rows.residuals - here.state.amounts.ravel()
        step = cho_solve(cho_factor(hessian), gradient)
        longest = float(np.linalg.norm(body.basis[body.patch] @ (follows @ step), axis=1).max())
        there = _lower(body, seen, here, min(1.0, _LONGEST_MM / longest) * step, cut) if longest > _STILL_MM else None
        if there is None:
            return ForceFit(here.state, here.rows, hessian, judgement.beliefs)
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


def _seen(body: PulledBody, seen: Seen, state: Pulled) -> _Place:
    return _Place(state, seen.rows(body.positions(state)))


def _lower(body: PulledBody, seen: Seen, here: _Place, step: FloatArray, cut: FloatArray) -> _Place | None:
    """Where a step, or a part of it, leads to less cost; None where none of them does."""
    cost = here.cost(cut)
    for _ in range(_HALVINGS):
        try:
            there = _seen(body, seen, body.moved(here.state, step))
            if there.cost(cut) < cost:
                return there
        except StageFailed:
            pass
        step = 0.5 * step
    return None
