"""Manoeuvres solved in full, with unknowns near to the plan's."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.errors import StageFailed
from glisson.core.protocols import Progress
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.registration.scenario_motion import Tangent
from glisson.mechanics.registration.scenario_unknowns import ScenarioUnknowns

_EXACTNESS = QuasiStaticParameters(tolerance=1e-4, step_deg=15.0, contact_range_mm=0.3, stick_mm=0.5)
"""Half as exact as a simulation that is shown, which is some tenths of a millimetre, in half the time."""

_STEP = 0.5
"""Standard deviations between two solutions that make a derivative."""

_HALVINGS = 3


class Manoeuvres:
    """Solves what the unknowns of a plan come to.

    Args:
        unknowns: of the plan.
    """

    def __init__(self, unknowns: ScenarioUnknowns) -> None:
        self._unknowns = unknowns
        self._solver = QuasiStatic(_EXACTNESS)

    def tangent(self, progress: Progress) -> Tangent:
        """The plan's own end, and its derivative by one more solution for each unknown.

        Raises:
            StageFailed: the plan, or one of its neighbours to either side, has no solution.
        """
        count = len(self._unknowns.every)
        progress(0.0, "the planned manoeuvre")
        planned = self._positions(np.zeros(count))
        columns = []
        for number, unknown in enumerate(self._unknowns.every):
            progress((number + 1) / (count + 2), f"what follows from {unknown.name}")
            columns.append(self._slope(planned, np.eye(count)[number]))
        return Tangent(np.zeros(count), planned, np.stack(columns, axis=2))

    def solved_towards(self, start: FloatArray, wanted: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Unknowns (k,) that have a solution, `wanted` or nearer to `start`, and the nodes (n, 3) at its end.

        Raises:
            StageFailed: there is none.
        """
        for halving in range(_HALVINGS):
            # Written so that no rounding is in the first: it is compared with what was wanted.
            amounts = wanted - (1.0 - 0.5**halving) * (wanted - start)
            try:
                return amounts, self._positions(amounts)
            except StageFailed as failure:
                last = failure
        raise last

    def _slope(self, planned: FloatArray, direction: FloatArray) -> FloatArray:
        try:
            return (self._positions(_STEP * direction) - planned) / _STEP
        except StageFailed:
            return (planned - self._positions(-_STEP * direction)) / _STEP

    def _positions(self, amounts: FloatArray) -> FloatArray:
        model, scenario = self._unknowns.at(amounts)
        found: Deformation = self._solver.solve(model, scenario)
        if not found.status.is_good:
            raise StageFailed(f"The adjusted manoeuvre was not solved: {found.message}", found.status)
        return found.mesh.moved(found.displacement)
