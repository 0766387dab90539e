"""The lever lift of the dissertation's chapter 4, proposed for any liver from its shape.

The board is tangent to the organ's underside; the lever lies under the left lobe (see `lever_placement`).
"""

import numpy as np

from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.model import Model
from glisson.core.scenario import ContactLaw, LeverDrive, Scenario, Stage
from glisson.core.tools import Board
from glisson.preoperative.scenario.lever_placement import DOWN, LeverLiftParameters, place_lever


def propose_scenario(model: Model, parameters: LeverLiftParameters | None = None) -> Scenario:
    """Board, lever under the left lobe, and the two stages: lifted with sticky contact, then settled.

    Stage 1 has friction and cohesion, stage 2 friction only, so that the lobe slides (both under gravity).
    Every node set that is no ligament is fixed.

    Raises:
        BadInput: nothing holds the organ, or no place under the left lobe suits a lever.
    """
    chosen = LeverLiftParameters() if parameters is None else parameters
    if not model.node_sets:
        raise BadInput("Nothing holds the organ: the model has no node set; name attachments.")
    fixed = tuple(name for name in model.node_sets if name not in model.ligaments)
    gas = chosen.gas_pressure_kpa
    board = Board(
        "board", np.array([0.0, _board_height(model.mesh, chosen.board_depth_mm), 0.0]), -DOWN, conforming=True
    )
    lift = LeverDrive("lever", angle_deg=chosen.angle_deg)
    return Scenario(
        tools=(board, place_lever(model.mesh, chosen)),
        stages=(
            Stage("stage 1", ContactLaw(chosen.friction, chosen.cohesion_kpa), (lift,), True, fixed, (), gas),
            Stage("stage 2", ContactLaw(chosen.friction, 0.0), (), True, fixed, (), gas),
        ),
        scan_gravity=DOWN,
        surgery_gravity=DOWN,
        scan_supports=("board",),
        rest_shape="from-gravity",
    )


def _board_height(mesh: TetMesh, depth_mm: float) -> float:
    """Y of a board under the organ: where 2 cm² of the surface would reach through it, at most `depth_mm` deep."""
    triangles, _ = mesh.boundary()
    corners = mesh.nodes[triangles]
    areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    heights = corners[:, :, 1].mean(axis=1)
    order = np.argsort(-heights)
    carried = int(np.searchsorted(np.cumsum(areas[order]), 200.0))
    lowest = float(mesh.nodes[np.unique(triangles), 1].max())
    return max(lowest - depth_mm, float(heights[order[min(carried, len(order) - 1)]]))
