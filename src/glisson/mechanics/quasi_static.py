"""The solver technique: rest shape, then stage after stage in load steps, each an equilibrium or a status."""

from dataclasses import dataclass, replace
from typing import ClassVar

from glisson.core.deformation import Deformation
from glisson.core.errors import StageFailed
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.scenario import Scenario
from glisson.core.status import Status
from glisson.mechanics.free_motion import find_free_motion
from glisson.mechanics.linear_solvers import make_iterative_solver
from glisson.mechanics.loaded_body import loaded_body
from glisson.mechanics.loads import gravity_forces
from glisson.mechanics.newton import Newton, NewtonSettings
from glisson.mechanics.numbering import numbering
from glisson.mechanics.quadratic_model import quadratic_model
from glisson.mechanics.stages import Carrier, StageRunner, WholeOrgan

REST_ACCURACY = 1e-8  # residual of the unloaded shape over the weight


@dataclass(frozen=True)
class StageParameters:
    """How exactly and in which steps stages are solved."""

    tolerance: float = parameter(1e-6, "residual over the largest force at which a step has converged", 1e-12, 1e-3)
    step_deg: float = parameter(8.0, "largest turn of a lever in one load step, in degrees", 0.05, 15.0)
    contact_range_mm: float = parameter(0.1, "gap in mm at which a tool begins to press", 1e-3, 2.0)
    stick_mm: float = parameter(0.2, "elastic slip in mm before friction gives way", 1e-4, 1.0)
    surface_tolerance_mm: float = parameter(
        2.0, "how far in mm the scanned surface may lie from a tool and still be taken as touching it", 0.0, 10.0
    )
    self_contact: bool = parameter(False, "whether parts of the organ's surface keep each other off (needs ipctk)")
    iteration_limit: int = parameter(25, "Newton iterations allowed in one load step", 1, 10_000)


@dataclass(frozen=True)
class QuasiStaticParameters(StageParameters):
    """Those of the stages, and the element."""

    element: str = parameter(
        "T10", "element: T10 (quadratic) or T4 (locks near incompressibility)", choices=("T4", "T10")
    )


class QuasiStatic:
    """Finite elements with frictional contact by Newton's method (design, section 3)."""

    name: ClassVar[str] = "quasi-static"
    summary: ClassVar[str] = "hyperelastic finite elements with frictional contact, in load steps"
    Parameters: ClassVar[type[QuasiStaticParameters]] = QuasiStaticParameters

    def __init__(self, parameters: QuasiStaticParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies; MKL makes it faster."""
        return ()

    def solve(self, model: Model, scenario: Scenario, progress: Progress = silent) -> Deformation:
        """Deformation through all stages; the mesh of the answer is T10 unless `element` is T4.

        Raises:
            BadInput: the model lacks a named node set, or a tool cuts deep into the organ at the start.
        """
        if self._parameters.element == "T10":
            model = quadratic_model(model)
        order = numbering(model.mesh.nodes)
        ordered = order.model(model)
        found = solve_stages(ordered, scenario, self._parameters, WholeOrgan(), REST_ACCURACY, progress)
        return order.deformation(found, model.mesh)


def solve_stages(
    model: Model,
    scenario: Scenario,
    parameters: StageParameters,
    carrier: Carrier,
    rest_accuracy: float,
    progress: Progress,
) -> Deformation:
    """Find the body's unloaded shape, and let a carrier take it through the stages."""
    try:
        progress(0.0, "finding the unloaded shape")
        body = loaded_body(model, scenario, parameters, rest_accuracy)
    except StageFailed as failure:
        unheld = _free_motion(model, scenario, parameters)
        if unheld is not None:
            return Deformation(model.mesh, (), Status.SINGULAR, f"The unloaded shape was not found: {unheld}.")
        return Deformation(model.mesh, (), failure.status, str(failure))
    settings = NewtonSettings(parameters.tolerance, parameters.iteration_limit)
    newton = Newton(body, make_iterative_solver(), settings)
    try:
        return StageRunner(model, scenario, body, newton, carrier, parameters.step_deg, progress).run()
    finally:
        newton.close()


def _free_motion(model: Model, scenario: Scenario, parameters: StageParameters) -> str | None:
    """What nothing held the scanned organ against, in words; None where something did."""
    body = loaded_body(model, replace(scenario, rest_shape="as-scanned"), parameters, REST_ACCURACY)
    body.external = gravity_forces(model, scenario.scan_gravity)
    motion = find_free_motion(body, model.mesh.nodes)
    return None if motion is None else motion.sentence
