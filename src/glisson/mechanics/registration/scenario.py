"""Technique "scenario": the planned manoeuvre, adjusted until its full contact model explains what was seen."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.core.scenario import Scenario
from glisson.core.status import Status
from glisson.mechanics.quadratic_model import quadratic_model
from glisson.mechanics.registration.basis import ElasticModes, boundary_responses
from glisson.mechanics.registration.checks import check_observations
from glisson.mechanics.registration.contradictions import contradiction, misfits
from glisson.mechanics.registration.elastic_parameters import ERROR_HELP, LENGTH_HELP
from glisson.mechanics.registration.expected_energy import energy_per_mode_uj
from glisson.mechanics.registration.fitting import Fit, fit
from glisson.mechanics.registration.outcome import outcome
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.posterior import spread_by
from glisson.mechanics.registration.scenario_forward import Manoeuvres
from glisson.mechanics.registration.scenario_motion import ScenarioMotion, Tangent
from glisson.mechanics.registration.scenario_unknowns import Doubt, ScenarioUnknowns
from glisson.mechanics.registration.seen import ModelError, Seen

_SETTLED_MM = 0.1
"""A prediction by the derivative that is off by less (root mean square) needs no further solution."""

_UNTOLD = 0.9
"""What keeps so much of its standard deviation is known from the plan alone."""


@dataclass(frozen=True)
class ScenarioParameters:
    """How far the plan may be off, and what it cannot explain."""

    angle_deg: float = parameter(5.0, "how far the lever's angle may be off the plan, degrees", minimum=1e-3)
    place_mm: float = parameter(4.0, "how far the lever's place may be off the plan, mm", minimum=1e-3)
    friction_factor: float = parameter(2.0, "by which factor friction may be off", minimum=1.001)
    stiffness_factor: float = parameter(1.5, "by which factor stiffness may be off", minimum=1.001)
    attachment_factor: float = parameter(3.0, "by which factor the attachments' stiffness may be off", minimum=1.001)
    controls: int = parameter(45, "number of points of the surface that move beyond the manoeuvre", minimum=3)
    strain: float = parameter(0.01, "typical strain that the manoeuvre cannot explain", minimum=1e-4)
    solves: int = parameter(4, "how often the adjusted manoeuvre is solved at most", minimum=1)
    model_error_mm: float = parameter(0.3, ERROR_HELP, minimum=1e-3)
    model_error_length_mm: float = parameter(20.0, LENGTH_HELP, minimum=1e-3)

    @property
    def doubt(self) -> Doubt:
        """What of it concerns the plan."""
        return Doubt(self.angle_deg, self.place_mm, self.friction_factor, self.stiffness_factor, self.attachment_factor)


class AdjustedScenario:
    """The loop of the dissertation's section 3.2.3, and a small elastic correction by boundary responses on top.

    Before surgery the plan is solved, and once more for each unknown. Then Gauss–Newton steps of all unknowns and the
    correction together go by that derivative; the adjusted manoeuvre is solved in full, the derivative learns from it,
    and so on until what it predicts is what is solved.
    """

    name: ClassVar[str] = "scenario"
    summary: ClassVar[str] = "the planned manoeuvre with its contacts, adjusted to what was seen"
    Parameters: ClassVar[type[ScenarioParameters]] = ScenarioParameters

    def __init__(self, parameters: ScenarioParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond the core."""
        return ()

    def prepare(
        self, model: Model, scenario: Scenario | None = None, progress: Progress = silent
    ) -> "PreparedScenario":
        """See `Registration`.

        Raises:
            BadInput: there is no scenario, or none that can be adjusted.
            StageFailed: the planned manoeuvre has no solution.
        """
        if scenario is None:
            raise BadInput(
                "The technique scenario adjusts a planned manoeuvre, and there is none; give the case a scenario.toml "
                "or choose another technique."
            )
        manoeuvres = Manoeuvres(ScenarioUnknowns(model, scenario, self._parameters.doubt))
        return self.with_tangent(model, scenario, manoeuvres.tangent(progress))

    def with_tangent(self, model: Model, scenario: Scenario, tangent: Tangent) -> "PreparedScenario":
        """The same where the plan and its derivative are known already."""
        organ = quadratic_model(model)
        there = replace(organ, mesh=replace(organ.mesh, nodes=tangent.positions))
        modes = boundary_responses(there, self._parameters.controls, scenario.stages[-1].fixed)
        unknowns = ScenarioUnknowns(model, scenario, self._parameters.doubt)
        return PreparedScenario(organ, self._parameters, unknowns, tangent, modes)


class PreparedScenario:
    """A plan that was solved (see `PreparedRegistration`).

    Args:
        model: with quadratic elements.
        parameters: of the technique.
        unknowns: of the plan.
        tangent: the plan's end, and how it depends on the unknowns.
        modes: how else the organ can deform there.
    """

    def __init__(
        self,
        model: Model,
        parameters: ScenarioParameters,
        unknowns: ScenarioUnknowns,
        tangent: Tangent,
        modes: ElasticModes,
    ) -> None:
        self._model, self._parameters, self._places = model, parameters, Places(model)
        self._unknowns, self._manoeuvres, self._modes = unknowns, Manoeuvres(unknowns), modes
        self.tangent = tangent

    def register(
        self, observations: Observations, last: Registered | None = None, progress: Progress = silent
    ) -> Registered:
        """See `PreparedRegistration`; it starts from the plan, whatever was `last`.

        Raises:
            BadInput: the observations cannot be of this model, or are not in the patient's frame.
            StageFailed: an adjusted manoeuvre has no solution.
        """
        check_observations(self._model, observations)
        if observations.frame != "patient":
            raise BadInput(
                f'The scenario\'s tools are in the frame "patient" and the observations in "{observations.frame}"; '
                "transform them into that of the patient first."
            )
        seen = self._seen(observations)
        tangent, found, settled = self.tangent, None, False
        for number in range(self._parameters.solves):
            progress(number / self._parameters.solves, "adjusting the manoeuvre")
            motion, found = self._fitted(tangent, seen, observations, found)
            wanted = motion.manoeuvre(found.state)
            amounts, positions = self._manoeuvres.solved_towards(tangent.amounts, wanted)
            off = positions - tangent.predicted(amounts)
            settled = bool(np.sqrt((off**2).sum(axis=1).mean()) < _SETTLED_MM and np.array_equal(amounts, wanted))
            tangent = tangent.moved_to(amounts, positions)
            if settled:
                break
        motion, found = self._fitted(tangent, seen, observations, found)
        wrong = misfits(seen, found.rows, found.shifts_mm)
        doubt = contradiction(observations, wrong, lambda some: self._fits(tangent, some))
        return self._answer(motion, found, settled, doubt)

    def _seen(self, observations: Observations) -> Seen:
        error = ModelError(self._parameters.model_error_mm, self._parameters.model_error_length_mm)
        return Seen(self._places, observations, error)

    def _fits(self, tangent: Tangent, observations: Observations) -> bool:
        """Whether some observations fit together next to the adjusted manoeuvre, as its derivative predicts."""
        seen = self._seen(observations)
        _, found = self._fitted(tangent, seen, observations, None)
        return not misfits(seen, found.rows, found.shifts_mm)

    def _fitted(
        self, tangent: Tangent, seen: Seen, observations: Observations, last: Fit | None
    ) -> tuple[ScenarioMotion, Fit]:
        touches = tuple(
            item for item in observations.items if item.kind == "contact" and item.name in self._unknowns.levers
        )
        energy_uj = energy_per_mode_uj(self._model, self._parameters.strain)
        motion = ScenarioMotion(
            self._unknowns, tangent, self._modes.basis, 2.0 * self._modes.energies_uj / energy_uj, touches
        )
        start = motion.state(np.zeros(motion.size)) if last is None else last.state
        return motion, fit(motion, seen, start)

    def _answer(self, motion: ScenarioMotion, found: Fit, settled: bool, doubt: str | None) -> Registered:
        positions, spread = motion.positions(found.state), spread_by(found.hessian, motion, found)
        answer = outcome(self._model, "patient", positions, spread, found.beliefs, doubt)
        answer = replace(answer, notes=(*answer.notes, *self._notes(motion, found)))
        if settled or not answer.status.is_good:
            return answer
        message = f"After {self._parameters.solves} solutions the adjusted manoeuvre still differs from its prediction."
        stages = tuple(replace(stage, status=Status.ITERATION_LIMIT) for stage in answer.deformation.stages)
        unsettled = replace(answer.deformation, stages=stages, status=Status.ITERATION_LIMIT, message=message)
        return replace(answer, deformation=unsettled)

    def _notes(self, motion: ScenarioMotion, found: Fit) -> list[str]:
        amounts = motion.manoeuvre(found.state)
        covariance = np.linalg.inv(found.hessian)[: len(amounts), : len(amounts)]
        sigma: FloatArray = np.sqrt(np.diag(covariance))
        untold = [u.name for u, width in zip(self._unknowns.every, sigma, strict=True) if width > _UNTOLD]
        notes = [f"The manoeuvre as it was: {self._unknowns.told(amounts, sigma)}."]
        return notes + [f"Nothing that was seen tells {name}; it is as planned." for name in untold]
