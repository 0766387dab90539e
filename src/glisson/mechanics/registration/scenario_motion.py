"""A manoeuvre near to one that was solved, and what it leaves out, as a way in which an organ may move."""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.observations import Observation
from glisson.mechanics.registration.motion import MotionState
from glisson.mechanics.registration.scenario_unknowns import ScenarioUnknowns

_STEP = 1e-4


@dataclass(frozen=True, eq=False)
class Tangent:
    """Nodes (n, 3) at the end of a manoeuvre with its unknowns at `amounts` (k,), and their derivative (n, 3, k)."""

    amounts: FloatArray
    positions: FloatArray
    derivative: FloatArray

    def predicted(self, amounts: FloatArray) -> FloatArray:
        """Nodes (n, 3) with the unknowns at other `amounts` (k,), by the derivative."""
        return self.positions + self.derivative @ (amounts - self.amounts)

    def moved_to(self, amounts: FloatArray, positions: FloatArray) -> "Tangent":
        """With a further solution: the derivative is the nearest one that explains it (Broyden 1965)."""
        step = amounts - self.amounts
        unexplained = positions - self.predicted(amounts)
        correction = unexplained[:, :, None] * step / max(float(step @ step), 1e-12)
        return Tangent(amounts, positions, self.derivative + correction)


class ScenarioMotion:
    """x = x₀ + U (p − p₀) + Φ a: p are a manoeuvre's unknowns, Φ what it cannot explain (see `Motion`).

    Its unknowns are p before a; there is no rigid motion, since the tools are known in the patient's frame. p costs
    ½ pᵀ p, and what contacts seen on a lever are away from it; a costs ½ aᵀ P a.

    Args:
        unknowns: of the manoeuvre.
        tangent: x₀, p₀ and U.
        basis: Φ (n, 3, m).
        precision: P (m,), a diagonal.
        touches: contacts that were seen on levers.
    """

    def __init__(
        self,
        unknowns: ScenarioUnknowns,
        tangent: Tangent,
        basis: FloatArray,
        precision: FloatArray,
        touches: tuple[Observation, ...],
    ) -> None:
        self._unknowns, self.tangent, self._touches = unknowns, tangent, touches
        self._precision = precision
        self._all = np.concatenate([tangent.derivative, basis], axis=2)
        self._count = len(tangent.amounts)
        self.size = self._all.shape[2]

    def state(self, amounts: FloatArray) -> MotionState:
        """The state with all unknowns (size,)."""
        return MotionState(np.eye(3), np.zeros(3), amounts)

    def manoeuvre(self, state: MotionState) -> FloatArray:
        """The manoeuvre's own unknowns (k,) in a state."""
        return state.amounts[: self._count]

    def positions(self, state: MotionState) -> FloatArray:
        """See `Motion`."""
        away = state.amounts.copy()
        away[: self._count] -= self.tangent.amounts
        return self.tangent.positions + self._all @ away

    def derivative(self, state: MotionState, nodes: IntArray) -> FloatArray:
        """See `Motion`."""
        return self._all[nodes]

    def prior(self, state: MotionState) -> tuple[float, FloatArray, FloatArray]:
        """See `Motion`."""
        own = np.concatenate([np.ones(self._count), self._precision])
        gradient, hessian = own * state.amounts, np.diag(own)
        cost = 0.5 * float(state.amounts @ gradient)
        for touch in self._touches:
            gaps, jacobian = self._gaps(touch, self.manoeuvre(state))
            cost += 0.5 * float(gaps @ gaps)
            gradient[: self._count] += gaps @ jacobian
            hessian[: self._count, : self._count] += jacobian.T @ jacobian
        return cost, gradient, hessian

    def moved(self, state: MotionState, step: FloatArray) -> MotionState:
        """See `Motion`."""
        return replace(state, amounts=state.amounts + step)

    def _gaps(self, touch: Observation, amounts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How many standard deviations (n,) points of contact are off the lever, and the derivative (n, k)."""

        def gaps(places: FloatArray) -> FloatArray:
            away: FloatArray = self._unknowns.lever_gaps(touch.name, touch.points_mm, places) / touch.sigma_mm
            return away

        steps = _STEP * np.eye(self._count)
        columns = [(gaps(amounts + step) - gaps(amounts - step)) / (2.0 * _STEP) for step in steps]
        return gaps(amounts), np.stack(columns, axis=1)
