"""What is done before surgery: the model that a user would have, and the planned lift solved."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.parameters import build_parameters
from glisson.core.scenario import Scenario
from glisson.core.structures import Structures
from glisson.geometry.quadratic import boundary_surface
from glisson.mechanics.registration.scenario import AdjustedScenario, ScenarioParameters
from glisson.mechanics.registration.scenario_motion import Tangent
from glisson.phantom.lift_truths import lift_truth
from glisson.phantom.proportions import draw_proportions
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.studies.lever_lift.cases import LeverCase, planned_scenario
from glisson.studies.lever_lift.truths import PACKAGES, case_of, structures_of
from glisson.studies.lifts import lift_model
from glisson.studies.meshing import member_surface
from glisson.studies.point import Outcome, Point, Task
from glisson.studies.store import read_arrays

PLAN = Task(
    f"{__name__}:solve_plan",
    (*PACKAGES, "glisson.mechanics", "glisson.preoperative", "glisson.studies.lifts", __name__),
)

TISSUE, FRICTION = Material("neo-hookean", 7.0, 0.45), 0.2
"""What a user who has measured nothing would take."""

_LIGAMENTS_KPA_MM = 0.5
"""The organ's back gives way by this, which can be adjusted; the truth holds a smaller part of it fast."""


def plan_point(truth: Point, parameters: Mapping[str, Any], edge_mm: float, envelope_mm: float) -> Point:
    """The point that plans the case of a truth's point."""
    sizes = {"edge_mm": edge_mm, "envelope_mm": envelope_mm}
    return Point(PLAN, {"case": truth.inputs["case"], "parameters": dict(parameters), **sizes}, cost=7.0)


def solve_plan(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Mesh in A, and the planned lift with its derivatives."""
    case = case_of(inputs)
    model = model_of(case, structures_of(case), inputs["edge_mm"], inputs["envelope_mm"])
    tangent = technique_of(inputs).prepare(model, planned(case)).tangent
    arrays = {
        "nodes": model.mesh.nodes,
        "tetrahedra": model.mesh.tetrahedra,
        "positions": tangent.positions,
        "derivative": tangent.derivative,
        "amounts": tangent.amounts,
    }
    return Outcome({"elements": len(model.mesh.tetrahedra)}, arrays)


def read_plan(folder: Path, key: str, structures: Structures) -> tuple[Model, Tangent]:
    """The model and its planned lift, which a point has solved.

    Raises:
        OSError: its file is missing or damaged.
    """
    arrays = read_arrays(folder, key)
    mesh = TetMesh(arrays["nodes"], arrays["tetrahedra"])
    tangent = Tangent(arrays["amounts"], arrays["positions"], arrays["derivative"])
    return _model(mesh, structures), tangent


def technique_of(inputs: Mapping[str, Any]) -> AdjustedScenario:
    """The technique with the parameters among the inputs of a point."""
    return AdjustedScenario(build_parameters(ScenarioParameters, inputs["parameters"], "scenario"))


def model_of(case: LeverCase, structures: Structures, edge_mm: float, envelope_mm: float) -> Model:
    """The model that a user would have of a liver: its scanned surface, coarse, of one tissue throughout."""
    if case.calculix is None:
        surface = member_surface(draw_proportions(case.member))
    else:
        surface = boundary_surface(lift_truth(case.calculix).read().deformation.mesh)
    mesh = Mmg(MmgParameters(edge_length_mm=edge_mm, envelope_mm=envelope_mm)).mesh(surface)
    return _model(mesh, structures)


def planned(case: LeverCase) -> Scenario:
    """The planned lift, in which nothing is held fast."""
    scenario = planned_scenario(case, FRICTION)
    return replace(scenario, stages=tuple(replace(stage, fixed=()) for stage in scenario.stages))


def _model(mesh: TetMesh, structures: Structures) -> Model:
    model = lift_model(mesh, TISSUE)
    return replace(model, structures=structures, ligaments=dict.fromkeys(model.node_sets, _LIGAMENTS_KPA_MM))
