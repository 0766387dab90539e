"""Newton's method for one equilibrium: exact stiffness first, energy line search, an honest ending."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.status import Status
from glisson.mechanics.body import Balance, Body, LoadState
from glisson.mechanics.condenser import CondensedStep, Condenser
from glisson.mechanics.contact import Touch
from glisson.mechanics.free_motion import find_free_motion
from glisson.mechanics.inexact_newton import step_accuracy
from glisson.mechanics.linear_solvers import LinearSolver
from glisson.mechanics.unsymmetric import solve_near_symmetric

_ARMIJO = 1e-4
_HALVINGS = 40
_ROUND_OFF = 1e-13  # share of the energy that may be lost to rounding in a difference of energies
_LONGEST_STEP = 0.05  # of the body's diagonal, for any node in one iteration
_SLOW = 1.5  # share of a residual that an iteration leaves, from which on exact contact may pay
_STALE_RESCUES = 2  # such steps in a row that may use the stiffness of an earlier one
_COUPLED_RESIDUAL = 1e-2  # below it friction that follows the pressure is worth its price
_CALM = 0.3  # what a step that no energy judges must make of the residual to be taken
_RENEWALS = 12  # iterations in which points that leave lose their cohesion at once
_PATCHED_HALVINGS = 6
_LONGEST_PAUSE = 7  # iterations between attempts at exact contact that failed
_INNER_TOLERANCE = 0.1  # of the outer one
_FIRST_ACCURACY = 0.1  # of the first-order answer to a load step …
_CARRIED_ACCURACY = 1e-3  # … in which nodes are carried: a rough one moves the organ only beside them
_LOOSEST = 0.1  # accuracy of a Newton step
_LOOSE_STEPS = 8  # steps in a row of a body that nothing holds, before its free motion is looked for


@dataclass(frozen=True)
class NewtonSettings:
    """Relative residual to reach, and iterations allowed."""

    tolerance: float = 1e-6
    iteration_limit: int = 25


@dataclass(frozen=True, eq=False)
class NewtonEnd:
    """Where the iteration ended and how; `reason` is a sentence where it is not converged."""

    positions: FloatArray
    status: Status
    iterations: int
    residual: float
    reason: str = ""


@dataclass(frozen=True, eq=False)
class _Direction:
    """A step (n, 3) in mm, and whether the body was held without glue, and by its exact stiffness."""

    step: FloatArray
    held: bool
    exact: bool = False


class Newton:
    """Minimises the potential of a body; keeps what its solver found out over calls."""

    def __init__(self, body: Body, solver: LinearSolver, settings: NewtonSettings) -> None:
        self._body = body
        self._solver = solver
        self._condenser = Condenser(body)
        self._inner_tolerance = _INNER_TOLERANCE * settings.tolerance
        self.settings = settings
        self._longest_step_mm = _LONGEST_STEP * float(np.linalg.norm(np.ptp(body.elasticity.rest, axis=0)))

    def solve(self, positions: FloatArray, tolerance: float | None = None) -> NewtonEnd:
        """Equilibrium near `positions` with the body's present tools, loads, friction law and cohering points.

        A looser `tolerance` than that of the settings serves where the points that cohere are still sought.
        """
        body, settings = self._body, self.settings
        tolerance = settings.tolerance if tolerance is None else tolerance
        loose_steps = waits = pause = rescues = 0
        before = np.inf
        for iteration in range(settings.iteration_limit + 1):
            if iteration < _RENEWALS:
                body.renew_cohesion(positions)
            touches = body.touches(positions)
            balance = body.balance(positions, touches)
            if balance.residual <= tolerance:
                return NewtonEnd(positions, Status.CONVERGED, iteration, balance.residual)
            if iteration == settings.iteration_limit or loose_steps == _LOOSE_STEPS:
                break
            slow = balance.residual > _SLOW * before
            if slow and waits == 0:
                # At first with the organ's stiffness of an earlier step, which costs no factorisation.
                moved = self._patched(positions, touches, balance, exact=rescues >= _STALE_RESCUES)
                rescues += 1
                if moved is not None:
                    positions, pause = moved, 0
                    continue
                pause = min(2 * pause + 1, _LONGEST_PAUSE)
                waits = pause
            else:
                rescues = rescues if slow else 0
                waits -= int(slow)
            accuracy, before = step_accuracy(balance.residual, before, tolerance, _LOOSEST), balance.residual
            moved = self._coupled(positions, touches, balance, accuracy)
            if moved is not None:
                positions = moved
                continue
            direction = self._direction(positions, touches, balance.unbalanced, accuracy)
            moved = None if direction is None else self._search(positions, direction, balance)
            if direction is None or moved is None:
                moved = self._patched(positions, touches, balance, exact=True)
                if moved is None:
                    return self._ended(positions, Status.STAGNATED, iteration, balance)
                positions = moved
                continue
            loose_steps = 0 if direction.held else loose_steps + 1
            if not direction.held:
                body.add_cohesion(touches)  # perhaps nothing else holds it
            positions = moved
        return self._ended(positions, Status.ITERATION_LIMIT, iteration, balance)

    def close(self) -> None:
        """Give the factors' memory back."""
        self._solver.close()
        self._condenser.close()

    def is_exact(self, end: NewtonEnd) -> bool:
        """Whether an end reached the tolerance of the settings and not only a looser one."""
        return end.status is Status.CONVERGED and end.residual <= self.settings.tolerance

    def advance(self, positions: FloatArray, goal: LoadState) -> FloatArray | None:
        """First-order answer (n, 3) to other tools and loads, which become the body's; None where there is none.

        The organ goes along with moving tools and carried parts instead of being overrun by them; while they
        stand still, an organ on tools, or without an answer, stays where it is.
        """
        body = self._body
        carried = goal.carried - body.carried
        moving = goal.tools.angles != body.loading.tools.angles or bool(carried.any())
        patch = self._condenser.patch(positions, goal.tools.angles)
        if patch is not None and not moving:
            body.loading = goal
            return positions
        body.renew_cohesion(positions)
        touches = body.touches(positions)
        balance = body.balance(positions, touches)
        change, blocks = body.load_change(positions, goal), None
        if carried.any():
            blocks = body.stiffness(positions, touches, project=False)
            change = change - (body.matrix(blocks) @ carried.ravel()).reshape(carried.shape)
        change = np.where(body.fixed, 0.0, change)
        if patch is None:
            forces = balance.unbalanced + change
            accuracy = _CARRIED_ACCURACY if carried.any() else _FIRST_ACCURACY
            direction = self._direction(positions, touches, forces, accuracy, blocks)
            step = None if direction is None else direction.step
        else:
            answer = self._condenser.step(
                patch, positions, touches, balance, change, carried, goal.tools, self._inner_tolerance, exact=True
            )
            step = None if answer is None else answer.step
        if step is None and moving:
            return None
        body.loading = goal
        return positions if step is None else positions + step + carried

    def _patched(
        self, positions: FloatArray, touches: Sequence[Touch], balance: Balance, exact: bool
    ) -> FloatArray | None:
        """Newton's step with exact contact at moving tools; None where there are none or that does not pay."""
        body = self._body
        tools = body.loading.tools
        patch = self._condenser.patch(positions, tools.angles)
        if patch is None:
            return None
        memory = body.memory()
        none = np.zeros_like(positions)
        answer = self._condenser.step(
            patch, positions, touches, balance, none, none, tools, self._inner_tolerance, exact
        )
        if answer is not None and self._allowed_share(answer.step) == 1.0:
            moved = self._search_gain(positions, answer, balance)
            if moved is not None:
                return moved
        body.recall(memory)
        return None

    def _search_gain(self, positions: FloatArray, answer: CondensedStep, balance: Balance) -> FloatArray | None:
        """Backtrack until the energy falls by a share of what the linearised organ promised."""
        start = self._body.energy(positions)
        scale = abs(start) + float(np.abs(self._body.external * positions).sum())
        length = 1.0
        for _ in range(_PATCHED_HALVINGS):
            moved: FloatArray = positions + length * answer.step
            if self._body.energy(moved) <= start - _ARMIJO * length * answer.gain + _ROUND_OFF * scale:
                return moved
            length *= 0.5
        return None

    def _allowed_share(self, direction: FloatArray) -> float:
        """How much of a step may be taken: an organ that nothing holds yet must not fly away."""
        longest = float(np.linalg.norm(direction, axis=1).max())
        return min(1.0, self._longest_step_mm / longest) if longest > 0.0 else 1.0

    def _direction(
        self,
        positions: FloatArray,
        touches: Sequence[Touch],
        forces: FloatArray,
        accuracy: float,
        exact: FloatArray | None = None,
    ) -> _Direction | None:
        """Newton's direction; the stiffness is made definite only when Cholesky refuses the `exact` one.

        A body that would fly away is first glued to the tools it nearly touches, until their pressure, and with
        it their friction, has come to bear.
        """
        body = self._body
        for project in (False, True):
            blocks = exact if exact is not None and not project else body.stiffness(positions, touches, project)
            direction = self._solved(positions, blocks, forces, accuracy)
            if direction is not None:
                break
        if direction is not None and self._allowed_share(direction) == 1.0:
            return _Direction(direction, held=True, exact=not project)
        body.add_bonds(positions, blocks)
        glued = self._solved(positions, blocks, forces, accuracy)
        if glued is not None:
            return _Direction(self._allowed_share(glued) * glued, held=False)
        # A motion without stiffness is left: a small spring on every unknown keeps the step finite.
        for share in (1e-8, 1e-6, 1e-4, 1e-2):
            body.add_shift(share, blocks)
            direction = self._solved(positions, blocks, forces, accuracy)
            if direction is not None:
                return _Direction(self._allowed_share(direction) * direction, held=False)
        return None

    def _coupled(
        self, positions: FloatArray, touches: Sequence[Touch], balance: Balance, accuracy: float
    ) -> FloatArray | None:
        """Near the end, the exact step, in which friction follows the pressure; None where it does not pay.

        Without it the iteration converges only linearly. The matrix is not symmetric and friction has no
        energy: the residual judges.
        """
        body = self._body
        rubbing = bool(body.contacts) and body.law.friction > 0.0
        if balance.residual > _COUPLED_RESIDUAL or not rubbing:
            return None
        blocks = body.stiffness(positions, touches, project=False)
        if not self._solver.factor(body.tangent(positions, blocks.copy())):
            return None
        body.add_friction_by_pressure(positions, touches, blocks)
        step = solve_near_symmetric(body.tangent(positions, blocks), self._solver, balance.unbalanced, accuracy)
        return positions + step if self._calms(positions, step, balance.residual) else None

    def _calms(self, positions: FloatArray, step: FloatArray, residual: float) -> bool:
        """Whether a step brings the residual down by far; friction is as it was where it does not."""
        body, moved = self._body, positions + step
        if not body.is_possible(moved):
            return False
        if body.balance(moved, body.touches(moved)).residual < _CALM * residual:
            return True
        body.touches(positions)
        return False

    def _solved(
        self, positions: FloatArray, blocks: FloatArray, forces: FloatArray, accuracy: float
    ) -> FloatArray | None:
        """The displacement (n, 3) under the forces; None where the matrix is not definite."""
        if not self._solver.factor(self._body.tangent(positions, blocks)):
            return None
        step = self._solver.solve(forces, accuracy)
        return step if step is not None and np.isfinite(step).all() else None

    def _search(self, positions: FloatArray, direction: _Direction, balance: Balance) -> FloatArray | None:
        """Backtrack until the energy falls enough; None where no step lowers it.

        Where a whole step promises less than rounding makes of energies, the residual judges it. Where the organ
        snaps through, the stiffness that was made definite is much too stiff; there longer steps are tried as long as
        the energy falls.
        """
        body, step = self._body, direction.step
        start = body.energy(positions)
        slope = -float(np.vdot(balance.unbalanced, step))
        if slope >= 0.0:
            return None
        scale = abs(start) + float(np.abs(body.external * positions).sum())
        length = 1.0
        for _ in range(_HALVINGS):
            reached = body.energy(positions + length * step)
            if reached <= start + _ARMIJO * length * slope + _ROUND_OFF * scale:
                break
            if length == 1.0 and -slope <= _ROUND_OFF * scale and self._calms(positions, step, balance.residual):
                break
            length *= 0.5
        else:
            return None
        while length >= 1.0 and not direction.exact and self._allowed_share(2.0 * length * step) == 1.0:
            further = body.energy(positions + 2.0 * length * step)
            if further >= reached:
                break
            length, reached = 2.0 * length, further
        return positions + length * step

    def _ended(self, positions: FloatArray, status: Status, iterations: int, balance: Balance) -> NewtonEnd:
        motion = find_free_motion(self._body, positions)
        if motion is not None:
            return NewtonEnd(positions, Status.SINGULAR, iterations, balance.residual, motion.sentence)
        return NewtonEnd(positions, status, iterations, balance.residual, "")
