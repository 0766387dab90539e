"""The computation of the study: a drawn lift, from the member's shape to the solved manoeuvre."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.scenario import LeverDrive, Scenario
from glisson.core.tools import Board, Lever
from glisson.core.units import radians
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.phantom.lever_lift import lever_lift
from glisson.phantom.proportions import Proportions, draw_proportions
from glisson.phantom.truth_checks import gap_to_lever, height_over_board, inverted_elements, surface_nodes
from glisson.studies.lift_robustness.cases import LiftCase
from glisson.studies.lifts import LIFT_PACKAGES, lift_model, outcome_of, with_contact
from glisson.studies.meshing import member_mesh
from glisson.studies.point import Outcome, Task

LIFT = Task(
    f"{__name__}:solve_case",
    (
        *LIFT_PACKAGES,
        "glisson.studies.lifts",
        "glisson.studies.meshing",
        "glisson.studies.lift_robustness.cases",
        __name__,
    ),
)


def solve_case(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Mesh the member, lift its lobe, and check the end with code that shares nothing with the solver's."""
    case = LiftCase(**inputs["case"])
    proportions = draw_proportions(case.member)
    mesh = member_mesh(proportions, inputs["edge_length_mm"])
    scenario = scenario_of(case, proportions)
    model = lift_model(mesh, Material("neo-hookean", case.young_modulus_kpa, case.poisson_ratio))
    deformation = QuasiStatic(QuasiStaticParameters()).solve(model, scenario)
    more = {"elements": len(mesh.tetrahedra), **_checks(deformation, scenario, case.angle_deg)}
    return outcome_of(deformation, more)


def scenario_of(case: LiftCase, proportions: Proportions) -> Scenario:
    """The manoeuvre of the family with this case's lever and contact."""
    scenario = with_contact(lever_lift(proportions), case.friction, case.cohesion_kpa)
    board, lever = scenario.tools
    turn = radians(case.turn_deg)
    arm = np.array([np.cos(turn), 0.0, np.sin(turn)])
    hinge = proportions.place([case.hinge_x_mm, 0.0, case.hinge_z_mm])
    moved = Lever.lifting(lever.name, hinge, arm, np.array([0.0, -1.0, 0.0]))
    lift, settle = scenario.stages
    driven = replace(lift, drives=(LeverDrive(lever.name, angle_deg=case.angle_deg),))
    return replace(scenario, tools=(board, moved), stages=(driven, settle))


def _checks(deformation: Deformation, scenario: Scenario, angle_deg: float) -> dict[str, Any]:
    """Inverted elements, and how far surface nodes stay out of the tools (mm), at the stages that were reached.

    A node that lay inside a tool in the scanned shape, by what a mesh strays from the organ, is counted
    from there.
    """
    mesh = deformation.mesh
    inverted, gaps = 0, []
    before = np.minimum(_node_gaps(mesh, mesh.nodes, scenario, 0.0), 0.0)
    for stage in deformation.stages:
        if stage.status.is_good:
            nodes = mesh.moved(stage.displacement)
            inverted = max(inverted, inverted_elements(mesh, nodes))
            gaps.append(float((_node_gaps(mesh, nodes, scenario, radians(angle_deg)) - before).min()))
    return {"inverted": inverted, "node_gap_mm": min(gaps, default=None)}


def _node_gaps(mesh: TetMesh, nodes: Any, scenario: Scenario, angle_rad: float) -> Any:
    """Gaps (tools, n) of the surface's nodes."""
    points = nodes[surface_nodes(mesh)]
    boards = [height_over_board(points, tool) for tool in scenario.tools if isinstance(tool, Board)]
    levers = [gap_to_lever(points, tool, angle_rad) for tool in scenario.tools if isinstance(tool, Lever)]
    return np.stack([*boards, *levers])
