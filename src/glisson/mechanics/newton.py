"""Newton's method for one equilibrium: exact stiffness first, energy line search, an honest ending."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.status import Status
from glisson.mechanics.body import Balance, Body
from glisson.mechanics.contact import Touch
from glisson.mechanics.free_motion import find_free_motion
from glisson.mechanics.linear_solvers import Factorisation

_ARMIJO = 1e-4
_HALVINGS = 40
_ROUND_OFF = 1e-13  # share of the energy that may be lost to rounding in a difference of energies
_SETTLED_RESIDUAL = 0.1  # above it cohesion begins where points press, below it cohesion only ends
_LONGEST_STEP = 0.05  # of the body's diagonal, for any node in one iteration
_LONG_STEPS = 8  # steps at the length limit in a row before a free motion is looked for


@dataclass(frozen=True)
class NewtonSettings:
    """Relative residual to reach, and iterations allowed."""

    tolerance: float = 1e-6
    iteration_limit: int = 40


@dataclass(frozen=True, eq=False)
class NewtonEnd:
    """Where the iteration ended and how; `reason` is a sentence where it is not converged."""

    positions: FloatArray
    status: Status
    iterations: int
    residual: float
    reason: str = ""


class Newton:
    """Minimises the potential of a body; keeps the factorisation's analysis over calls."""

    def __init__(self, body: Body, factorisation: Factorisation, settings: NewtonSettings) -> None:
        self._body = body
        self._factorisation = factorisation
        self._settings = settings
        self._longest_step_mm = _LONGEST_STEP * float(np.linalg.norm(np.ptp(body.elasticity.rest, axis=0)))

    def solve(self, positions: FloatArray) -> NewtonEnd:
        """Equilibrium near `positions` with the body's present tools, loads and friction law.

        Cohesion may begin at new points while the residual is large, and end while it is small: each only
        in one direction, so that the iteration cannot cycle between the two.
        """
        body, settings = self._body, self._settings
        long_steps = 0
        for iteration in range(settings.iteration_limit + 1):
            touches = body.touches(positions)
            balance = body.balance(positions, touches)
            (body.add_cohesion if balance.residual > _SETTLED_RESIDUAL else body.drop_cohesion)(touches)
            if balance.residual <= settings.tolerance:
                return NewtonEnd(positions, Status.CONVERGED, iteration, balance.residual)
            if iteration == settings.iteration_limit or long_steps == _LONG_STEPS:
                break
            direction = self._direction(positions, touches, balance.unbalanced)
            if direction is None:
                return self._ended(positions, Status.STAGNATED, iteration, balance)
            share = self._allowed_share(direction)
            moved = self._search(positions, share * direction, balance)
            if moved is None:
                return self._ended(positions, Status.STAGNATED, iteration, balance)
            long_steps = long_steps + 1 if share < 1.0 else 0
            positions = moved
        return self._ended(positions, Status.ITERATION_LIMIT, iteration, balance)

    def predict(self, positions: FloatArray, angles: Sequence[float], external: FloatArray) -> FloatArray:
        """First-order answer (n, 3) to turning the tools to `angles` and changing the dead loads.

        The tools' motion is part of the right-hand side, so that the organ goes along with them instead
        of being overrun.
        """
        body = self._body
        body.renew_cohesion(positions)
        touches = body.touches(positions)
        forces = body.balance(positions, touches).unbalanced + body.tool_motion_forces(positions, touches, angles)
        forces += np.where(body.fixed, 0.0, external - body.external)
        direction = self._direction(positions, touches, forces)
        if direction is None:
            return np.zeros_like(positions)
        return self._allowed_share(direction) * direction

    def _allowed_share(self, direction: FloatArray) -> float:
        """How much of a step may be taken: an organ that nothing holds yet must not fly away."""
        longest = float(np.linalg.norm(direction, axis=1).max())
        return min(1.0, self._longest_step_mm / longest) if longest > 0.0 else 1.0

    def _direction(self, positions: FloatArray, touches: Sequence[Touch], forces: FloatArray) -> FloatArray | None:
        """Newton's direction; the stiffness is made definite only when Cholesky refuses the exact one."""
        body = self._body
        for project in (False, True):
            blocks = body.stiffness(positions, touches, project)
            upper = body.upper(blocks)
            if self._factorisation.factor(upper):
                return self._solved(forces)
        body.add_bonds(positions, blocks)
        upper = body.upper(blocks)
        if self._factorisation.factor(upper):
            return self._solved(forces)
        # A motion without stiffness is left: a small spring on every unknown keeps the step finite.
        diagonal = upper.diagonal()
        for share in (1e-8, 1e-6, 1e-4, 1e-2):
            shifted = upper.copy()
            shifted.setdiag(diagonal + share * diagonal.mean())
            if self._factorisation.factor(shifted):
                return self._solved(forces)
        return None

    def _solved(self, forces: FloatArray) -> FloatArray | None:
        free = self._body.system.free
        direction = np.zeros(forces.size)
        direction[free] = self._factorisation.solve(forces.ravel()[free])
        return direction.reshape(forces.shape) if np.isfinite(direction).all() else None

    def _search(self, positions: FloatArray, direction: FloatArray, balance: Balance) -> FloatArray | None:
        """Backtrack until the energy falls enough; None where no step lowers it."""
        start = self._body.energy(positions)
        slope = -float(np.vdot(balance.unbalanced, direction))
        if slope >= 0.0:
            return None
        scale = abs(start) + float(np.abs(self._body.external * positions).sum())
        length = 1.0
        for _ in range(_HALVINGS):
            moved = positions + length * direction
            if self._body.energy(moved) <= start + _ARMIJO * length * slope + _ROUND_OFF * scale:
                return moved
            length *= 0.5
        return None

    def _ended(self, positions: FloatArray, status: Status, iterations: int, balance: Balance) -> NewtonEnd:
        motion = find_free_motion(self._body, positions)
        if motion is not None:
            return NewtonEnd(positions, Status.SINGULAR, iterations, balance.residual, motion.sentence)
        return NewtonEnd(positions, status, iterations, balance.residual, "")
