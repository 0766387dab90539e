"""The technique that solves with quadratic elements only where the organ moves."""

from dataclasses import dataclass, fields, replace
from typing import ClassVar

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.scenario import Scenario, Stage
from glisson.mechanics.body import LoadState
from glisson.mechanics.load_path import LoadPath
from glisson.mechanics.newton import NewtonEnd
from glisson.mechanics.numbering import numbering
from glisson.mechanics.quadratic_model import linear_model, quadratic_model, with_middles
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters, StageParameters, solve_stages
from glisson.mechanics.region_first import RegionFirst, Way

_SURVEY_TOLERANCE = 1e-2
_REST_ACCURACY = 1e-3  # leaves the scanned shape out of equilibrium by a hundredth of a millimetre at most


@dataclass(frozen=True)
class RegionOfInterestParameters(StageParameters):
    """Those of the stages, and what counts as still."""

    still_mm: float = parameter(
        12.0, "motion in mm of linear elements up to which they are not replaced by others on the way", 0.0, 1000.0
    )


class RegionOfInterest:
    """Linear elements, which lock but are cheap, survey the stages; quadratic ones follow where these moved.

    The dissertation's future work ("invariant planes") cuts the model where it hardly moves. Here the cut goes along as
    the survey says, and is put right at the end of every stage; see `RegionFirst`.
    """

    name: ClassVar[str] = "region-of-interest"
    summary: ClassVar[str] = "as quasi-static, but cut where the organ hardly moves: faster, and says what that costs"
    Parameters: ClassVar[type[RegionOfInterestParameters]] = RegionOfInterestParameters

    def __init__(self, parameters: RegionOfInterestParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies; MKL makes it faster."""
        return ()

    def solve(self, model: Model, scenario: Scenario, progress: Progress = silent) -> Deformation:
        """Deformation through all stages on a T10 mesh, with an estimate of what the cut costs.

        Where the survey finds no equilibrium, the whole organ is solved as by `QuasiStatic`.

        Raises:
            BadInput: the model lacks a named node set, or a tool cuts deep into the organ at the start.
        """
        parameters = self._parameters
        linear, corners = linear_model(model)
        order = numbering(linear.mesh.nodes)
        surveyor = _Surveyor()
        loose = replace(parameters, tolerance=max(parameters.tolerance, _SURVEY_TOLERANCE))
        survey = solve_stages(
            order.model(linear),
            _surveyed(scenario),
            loose,
            surveyor,
            _REST_ACCURACY,
            lambda fraction, words: progress(None, f"survey, {words}"),
        )
        if not survey.status.is_good:
            return QuasiStatic(_of_the_whole(parameters)).solve(model, scenario, progress)
        model = quadratic_model(model)
        ways = {}
        final = numbering(model.mesh.nodes)
        for key, way in surveyor.ways.items():
            ways[key] = [
                (reach, with_middles(model.mesh, corners, places[order.new] - linear.mesh.nodes)[final.old])
                for reach, places in way
            ]
        carrier = RegionFirst(ways, parameters.still_mm)
        found = solve_stages(final.model(model), scenario, parameters, carrier, _REST_ACCURACY, progress)
        return final.deformation(found, model.mesh)


class _Surveyor:
    """The `Carrier` that solves the whole organ, and keeps the positions (n, 3) of all load steps."""

    estimated_error: FloatArray | None = None

    def __init__(self) -> None:
        self.ways: dict[tuple[str, int], Way] = {}

    def carry(self, path: LoadPath, goal: LoadState) -> NewtonEnd:
        """In adaptive load steps."""
        end = path.ramp(goal)
        stage = path.history.stage
        self.ways[stage, sum(name == stage for name, _ in self.ways)] = path.steps
        return end


def _of_the_whole(parameters: RegionOfInterestParameters) -> QuasiStaticParameters:
    return QuasiStaticParameters(**{field.name: getattr(parameters, field.name) for field in fields(StageParameters)})


def _surveyed(scenario: Scenario) -> Scenario:
    """The stages up to the last one in which more changes than the contact law."""
    last = 0
    for number, (before, stage) in enumerate(zip(scenario.stages, scenario.stages[1:], strict=False), start=1):
        if _moves(before, stage):
            last = number
    return replace(scenario, stages=scenario.stages[: last + 1])


def _moves(before: Stage, stage: Stage) -> bool:
    loads = [(s.gravity, s.gas_pressure_kpa, s.fixed) for s in (before, stage)]
    return bool(stage.drives or stage.motions or stage.moves or before.moves) or loads[0] != loads[1]
