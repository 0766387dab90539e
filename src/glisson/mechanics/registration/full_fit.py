"""All nodes free: strain energy against what was seen, minimised by Newton's method on the whole mesh."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.damping import Damping
from glisson.core.errors import StageFailed
from glisson.core.model import Model
from glisson.core.status import Status
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.linear_solvers import make_direct_solver
from glisson.mechanics.pattern import FreeSystem, Stiffness, block_pattern
from glisson.mechanics.registration.drawing import SHIFT_PRECISION, shift_cost
from glisson.mechanics.registration.outliers import cuts, judged, narrowing
from glisson.mechanics.registration.rest import Rest
from glisson.mechanics.registration.rows import Rows
from glisson.mechanics.registration.seen import Seen

_ITERATIONS = 100
_AT_REST = 1e-3
_HOLDING = 1e-6
"""Stiffness per node (1/mm²) that keeps the matrix regular where nothing holds a rigid motion."""


@dataclass(frozen=True, eq=False)
class FullState:
    """Nodes (n, 3), the curves' shifts (q, 3), the rows there, beliefs (p,), what each row counts (r,), the cost."""

    positions: FloatArray
    shifts_mm: FloatArray
    rows: Rows
    beliefs: FloatArray
    weights: FloatArray
    cost: float


class FullFit:
    """The fit of one model to what was seen.

    Args:
        model: the organ.
        seen: against it.
        energy_uj: strain energy that costs as much as a residual of √2 standard deviations.
    """

    def __init__(self, model: Model, seen: Seen, energy_uj: float) -> None:
        mesh = model.mesh
        self._seen, self._energy_uj = seen, energy_uj
        self._elasticity = Elasticity(mesh, model.materials, mesh.nodes)
        # The shift of a curve is one more node, which belongs to no element.
        self._count, every = len(mesh.nodes), len(mesh.nodes) + seen.curves
        self._pattern = block_pattern(mesh.tetrahedra, every).with_groups(seen.groups(self._count))
        self._system = FreeSystem(self._pattern, np.zeros((every, 3), dtype=np.bool_))
        self._solver = make_direct_solver()

    def fit(self, positions: FloatArray) -> FullState:
        """Node positions of least cost near to `positions` (n, 3).

        Raises:
            StageFailed: it does not come to rest.
        """
        item, drawn = self._seen.item, self._seen.as_drawn
        begun = self._at(positions, drawn, cuts(self._seen.rows(positions, drawn), item))
        return narrowing(begun, lambda state: state.rows, item, self._descend)

    def posterior_spread(self, found: FullState, modes: int) -> FloatArray:
        """The least certain ways to move (n, 3, modes), each by one standard deviation."""
        if not self._solver.factor(self._hessian(found, 0.0)):
            raise StageFailed("How sure the registration is cannot be told.", Status.SINGULAR)
        size = found.positions.size + found.shifts_mm.size

        def back(load: FloatArray) -> FloatArray:
            answer: FloatArray = self._solved(load.reshape(-1, 3)).ravel()
            return answer

        count = min(modes, size - 1)
        values, vectors = eigsh(LinearOperator((size, size), matvec=back, dtype=np.float64), k=count, v0=np.ones(size))
        spread: FloatArray = (vectors * np.sqrt(np.maximum(values, 0.0))).reshape(-1, 3, count)
        return spread[: self._count]

    def close(self) -> None:
        """Give the factor's memory back."""
        self._solver.close()

    def _descend(self, begun: FullState, cut: FloatArray) -> FullState:
        rest = Rest(_AT_REST)
        here, damping = self._at(begun.positions, begun.shifts_mm, cut), Damping()
        for _ in range(_ITERATIONS):
            gradient = self._gradient(here)
            if not self._solver.factor(self._hessian(here, damping.share)):
                damping.raised()
                continue
            step = self._solved(-gradient)
            nodes, shifts = step[: self._count], step[self._count :]
            there = self._at(here.positions + nodes, here.shifts_mm + shifts, cut)
            gained = here.cost - there.cost
            if gained > 0.0:
                damping.eased(gained, -0.5 * float((gradient * step).sum()))
                here = there
                if rest.reached(here.cost):
                    return here
            elif not damping.raised():
                return here
        raise StageFailed("The organ does not come to rest on what was seen.", Status.ITERATION_LIMIT)

    def _at(self, positions: FloatArray, shifts_mm: FloatArray, cut: FloatArray) -> FullState:
        rows = self._seen.rows(positions, shifts_mm)
        judgement = judged(rows, cut)
        cost = judgement.cost + self._elasticity.energy(positions) / self._energy_uj + shift_cost(shifts_mm)
        return FullState(positions, shifts_mm, rows, judgement.beliefs, judgement.weights, cost)

    def _gradient(self, here: FullState) -> FloatArray:
        rows = here.rows
        pull = (here.weights * rows.residuals / rows.sigma_mm)[:, None] * rows.directions
        forces = self._elasticity.forces(here.positions) / self._energy_uj
        gradient = np.concatenate([forces, SHIFT_PRECISION * here.shifts_mm])
        nodes, weights = self._with_shifts(rows)
        np.add.at(gradient, nodes, -weights[:, :, None] * pull[:, None])
        return gradient

    def _with_shifts(self, rows: Rows) -> tuple[IntArray, FloatArray]:
        """Nodes (r, a + 1) and their weights, the shift of the row's curve as the last one."""
        drawn = rows.curve >= 0
        shift = np.where(drawn, self._count + rows.curve, rows.nodes[:, 0])
        nodes: IntArray = np.concatenate([rows.nodes, shift[:, None]], axis=1)
        return nodes, np.concatenate([rows.weights, drawn[:, None].astype(np.float64)], axis=1)

    def _hessian(self, here: FullState, damping: float) -> Stiffness:
        """Without the curvature of what turns: positive definite (Levenberg 1944, Teran et al. 2005)."""
        blocks = np.zeros((self._pattern.block_count, 3, 3))
        self._elasticity.add_stiffness(here.positions, self._pattern, blocks, project=True)
        blocks /= self._energy_uj
        rows = here.rows
        scaled = rows.directions * (np.sqrt(here.weights) / rows.sigma_mm)[:, None]
        nodes, weights = self._with_shifts(rows)
        self._pattern.add_groups(nodes, np.einsum("ra,rb,ri,rj->rabij", weights, weights, scaled, scaled), blocks)
        held = np.full(self._count + len(here.shifts_mm), _HOLDING)
        held[self._count :] = SHIFT_PRECISION
        self._pattern.add_diagonal(damping * self._pattern.diagonal(blocks).mean(axis=1) + held, blocks)
        return Stiffness(self._pattern, self._system, blocks, np.concatenate([here.positions, here.shifts_mm]))

    def _solved(self, load: FloatArray) -> FloatArray:
        answer = self._solver.solve(load, 1e-8)
        if answer is None:
            raise StageFailed("Nothing holds the organ.", Status.SINGULAR)
        return answer
