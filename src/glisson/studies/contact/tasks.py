"""The computation of the study: one drawn lift with both contacts."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.scenario import ContactLaw, Scenario
from glisson.core.tools import Board, Lever, Tool
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.tools import make_tool
from glisson.phantom.family import build_anatomy, scanned_structures
from glisson.phantom.proportions import draw_proportions
from glisson.studies.contact.ipc_lift import IpcLift, lift_by_ipc
from glisson.studies.lift_robustness.cases import LiftCase
from glisson.studies.lift_robustness.tasks import scenario_of
from glisson.studies.lifts import LIFT_PACKAGES, carried_centroid, lift_model
from glisson.studies.meshing import member_mesh
from glisson.studies.point import Outcome, Task

COMPARE = Task(
    f"{__name__}:compare_contact",
    (
        *LIFT_PACKAGES,
        "glisson.studies.lifts",
        "glisson.studies.meshing",
        "glisson.studies.lift_robustness.cases",
        "glisson.studies.lift_robustness.tasks",
        "glisson.studies.contact.ipc_lift",
        "glisson.studies.contact.ipc_tools",
        "glisson.studies.contact.tool_surfaces",
        __name__,
    ),
)

_CLEARANCE_MM = 0.3
_BEARS_N = 0.01


def compare_contact(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Where the lobe ends with both contacts, and how far apart (mm) they put the tumours."""
    case = LiftCase(**inputs["case"])
    proportions = draw_proportions(case.member)
    mesh = member_mesh(proportions, inputs["edge_length_mm"])
    model = lift_model(mesh, Material("neo-hookean", case.young_modulus_kpa, case.poisson_ratio))
    scenario = _from_the_air(scenario_of(case, proportions), mesh, case.friction)
    started = perf_counter()
    ours = QuasiStatic(QuasiStaticParameters()).solve(model, scenario)
    between = perf_counter()
    other = lift_by_ipc(model, scenario)
    values = {
        "elements": len(mesh.tetrahedra),
        "our_seconds": between - started,
        "ipc_seconds": perf_counter() - between,
        "our_status": ours.status,
        "ipc_status": other.deformation.status,
    }
    for found in (ours, other.deformation):
        if not found.status.is_good:
            return Outcome(values, {}, found.status, found.message)
    tumours = scanned_structures(build_anatomy(case.member).interior, None).tumours
    ends = [[carried_centroid(found, tumour) for tumour in tumours] for found in (ours, other.deformation)]
    before = [tumour.centroid_mm for tumour in tumours]
    return Outcome(
        values
        | {
            "our_branch": _branch(_our_force_n(ours)),
            "ipc_branch": _branch(_ipc_force_n(other, scenario)),
            "moved_mm": [float(np.linalg.norm(a - b)) for a, b in zip(ends[0], before, strict=True)],
            "apart_mm": [float(np.linalg.norm(a - b)) for a, b in zip(*ends, strict=True)],
        }
    )


def _from_the_air(scenario: Scenario, mesh: TetMesh, friction: float) -> Scenario:
    """The lift with plain friction, the tools clear of the organ, which sinks onto them: both contacts can do it."""
    down = scenario.surgery_gravity
    assert down is not None  # the family's lifts have gravity
    gaps = [make_tool(tool).distance(_in_frame(tool, mesh)).min() for tool in scenario.tools]
    drop = (_CLEARANCE_MM + max(0.0, -float(min(gaps)))) * down
    lift, _ = scenario.stages
    law = ContactLaw(friction)
    stages = (replace(lift, name="settle", contact=law, drives=()), replace(lift, name="lift", contact=law))
    tools = tuple(_moved(tool, drop) for tool in scenario.tools)
    return Scenario(tools, stages, None, down, (), "as-scanned")


def _in_frame(tool: Tool, mesh: TetMesh) -> FloatArray:
    rotation, translation = make_tool(tool).pose(0.0)
    places: FloatArray = (mesh.nodes - translation) @ rotation
    return places


def _moved(tool: Tool, shift: FloatArray) -> Tool:
    if isinstance(tool, Board):
        return replace(tool, point_mm=tool.point_mm + shift)
    assert isinstance(tool, Lever)  # the family's lifts have no other tools
    return replace(tool, hinge_mm=tool.hinge_mm + shift)


def _branch(force_n: Sequence[float] | FloatArray) -> str:
    return "on the lever" if float(np.linalg.norm(force_n)) > _BEARS_N else "slipped off"


def _our_force_n(deformation: Deformation) -> tuple[float, float, float]:
    return next(contact.force_n for contact in deformation.stages[-1].contacts if contact.tool == "lever")


def _ipc_force_n(lift: IpcLift, scenario: Scenario) -> FloatArray:
    return next(force for tool, force in zip(scenario.tools, lift.forces_n, strict=True) if tool.name == "lever")
