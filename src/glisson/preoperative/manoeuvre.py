"""The lever lift of the dissertation's chapter 4, proposed for any liver from its shape.

The board is tangent to the organ's underside. The lever lies under the left lobe, which is the part of
the organ furthest to the patient's left. On a board its underside is flat, in the body it hangs in the
air and slopes: so the bar is laid against the lobe from below, as a straight edge would come to rest.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.core.scenario import Board, ContactLaw, Lever, LeverDrive, Scenario, Stage

DOWN = np.array([0.0, 1.0, 0.0])
"""Gravity of a patient who lies on the back, and of the organ on its board (LPS)."""

_LEFT = np.array([1.0, 0.0, 0.0])

_GAP_WEIGHT = 8.0
"""How many mm of bar under the lobe a median gap of 1 mm is worth when the hinge is chosen."""

_STEEPEST = np.tan(np.radians(30.0))
"""Largest slope of the bar at angle 0 in the body."""

_SAMPLE_MM = 2.0
"""The underside is looked at in points so far apart."""


@dataclass(frozen=True)
class LeverLiftParameters:
    """The lever, how far it goes and how it holds the organ."""

    angle_deg: float = parameter(22.0, "Angle to which the lever is lifted.", 0.0, 60.0)
    friction: float = parameter(0.1, "Coefficient of friction of board and lever.", 0.0, 2.0)
    cohesion_kpa: float = parameter(10.0, "Cohesion in stage 1, kPa; stage 2 has none.", 0.0, 1000.0)
    lobe_fraction: float = parameter(
        0.25, "The left lobe is at most this fraction of the organ's volume, from its left end.", 0.05, 0.6
    )
    gap_mm: float = parameter(0.75, "Gap between lever and lobe before it is lifted.", 0.0, 10.0)
    width_mm: float = parameter(25.0, "Width of the bar.", 2.0, 200.0)
    thickness_mm: float = parameter(8.0, "Thickness of the bar.", 1.0, 50.0)
    board_depth_mm: float = parameter(
        1.0, "How deep the board may cut the lowest bumps of the scanned surface.", 0.0, 5.0
    )


def propose_scenario(model: Model, parameters: LeverLiftParameters | None = None) -> Scenario:
    """Board, lever under the left lobe, and the two stages: lifted with sticky contact, then settled.

    Stage 1 has friction and cohesion, stage 2 friction only, so that the lobe slides (both under gravity).
    The node set "back" is fixed.

    Raises:
        BadInput: the model has no node set "back", or no place under the left lobe suits a lever.
    """
    chosen = LeverLiftParameters() if parameters is None else parameters
    model.node_set("back")
    board = Board(
        "board", np.array([0.0, _board_height(model.mesh, chosen.board_depth_mm), 0.0]), -DOWN, conforming=True
    )
    lift = LeverDrive("lever", angle_deg=chosen.angle_deg)
    return Scenario(
        tools=(board, place_lever(model.mesh, chosen)),
        stages=(
            Stage("stage 1", ContactLaw(chosen.friction, chosen.cohesion_kpa), (lift,)),
            Stage("stage 2", ContactLaw(chosen.friction, 0.0)),
        ),
        scan_gravity=DOWN,
        surgery_gravity=DOWN,
        scan_supports=("board",),
        rest_shape="from-gravity",
    )


def place_lever(mesh: TetMesh, parameters: LeverLiftParameters) -> Lever:
    """A lever whose bar touches the left lobe from below all but `gap_mm`, hinge on the medial side.

    Of all hinges within the lobe the one is taken that gives the longest bar close to the lobe. The bar
    lies a little above the lobe's middle (towards the head): in the very middle the lobe could roll to
    either side.

    Raises:
        BadInput: the organ's left part has no underside that a bar could touch.
    """
    centres = mesh.nodes[mesh.corners].mean(axis=1)
    volumes = mesh.corner_volumes_mm3
    medial_limit = _quantile(centres[:, 0], volumes, 1.0 - parameters.lobe_fraction)
    lobe = centres[:, 0] >= medial_limit
    middle = _quantile(centres[lobe, 2], volumes[lobe], 0.6)
    underside = _underside(mesh, middle, parameters.width_mm + 2.0 * _SAMPLE_MM)
    tip = float(underside[:, 0].max()) if len(underside) else medial_limit
    # When the bar is lifted the lower edge of its medial end swings back by thickness × sin(angle).
    margin = parameters.thickness_mm * np.sin(np.radians(parameters.angle_deg)) + parameters.gap_mm + 1.0
    best: tuple[float, float, float, float] | None = None
    for hinge in np.arange(medial_limit, tip - parameters.width_mm, _SAMPLE_MM):
        beyond = underside[underside[:, 0] >= hinge - margin]
        height, slope, gap = _resting_edge(beyond, float(hinge), tip)
        score = tip - hinge - _GAP_WEIGHT * gap
        if best is None or score > best[0]:
            best = (float(score), float(hinge), height, slope)
    if best is None:
        raise BadInput(
            f"The left lobe offers no underside of {parameters.width_mm:g} mm for a lever; give the lever in "
            "scenario.toml, or choose a larger lobe_fraction."
        )
    _, hinge, height, slope = best
    arm = np.array([1.0, slope, 0.0]) / np.hypot(1.0, slope)
    up = np.cross(np.cross(arm, -DOWN), arm)
    start = np.array([hinge, height, middle]) - parameters.gap_mm * up / np.linalg.norm(up)
    return Lever.lifting(
        "lever",
        start,
        arm,
        up,
        length_mm=max(150.0, (tip - hinge) * float(np.hypot(1.0, slope)) + 20.0),
        width_mm=parameters.width_mm,
        thickness_mm=parameters.thickness_mm,
        edge_radius_mm=min(3.0, parameters.thickness_mm / 2.0),
    )


def _resting_edge(points: FloatArray, hinge: float, tip: float) -> tuple[float, float, float]:
    """A straight edge that supports underside points (n, 2: x, y) from below at the lobe's middle.

    Returns its height y at the hinge, its slope dy/dx and the median gap over the lobe in mm.
    """
    slope = _hull_slope(points, 0.5 * (hinge + tip))
    slope = float(np.clip(slope, -_STEEPEST, _STEEPEST))
    offset = float((points[:, 1] - slope * points[:, 0]).max())
    places = np.arange(hinge, tip, _SAMPLE_MM)
    cells = np.digitize(points[:, 0], places) - 1
    lowest = np.full(len(places), -np.inf)
    inside = cells >= 0
    np.maximum.at(lowest, cells[inside], points[inside, 1])
    known = np.isfinite(lowest)
    gaps = offset + slope * places[known] - lowest[known]
    return offset + slope * hinge, slope, float(np.median(gaps)) if known.any() else np.inf


def _hull_slope(points: FloatArray, x: float) -> float:
    """Slope of the lower side (largest y) of the points' convex hull over x; 0 where there is none."""
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return 0.0
    for (normal_x, normal_y, _), simplex in zip(hull.equations, hull.simplices, strict=True):
        ends = points[simplex, 0]
        if normal_y > 1e-9 and ends.min() <= x <= ends.max():
            return float(-normal_x / normal_y)
    return 0.0


def _underside(mesh: TetMesh, z: float, width_mm: float) -> FloatArray:
    """X and y (n, 2) of points on downward faces within a strip of that width about z, about 2 mm apart."""
    triangles, _ = mesh.boundary()
    corners = mesh.nodes[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    nearby = np.abs(corners[:, :, 2] - z).min(axis=1) <= 0.5 * width_mm
    across = (corners[:, :, 2].min(axis=1) < z) & (corners[:, :, 2].max(axis=1) > z)
    corners = corners[(normals @ DOWN > 0.0) & (nearby | across)]
    if not len(corners):
        return np.zeros((0, 2))
    longest = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
    steps = int(np.ceil(longest / _SAMPLE_MM))
    weights = np.array([(a, b, steps - a - b) for a in range(steps + 1) for b in range(steps + 1 - a)]) / steps
    points = np.einsum("sc,tci->tsi", weights, corners).reshape(-1, 3)
    inside: FloatArray = points[np.abs(points[:, 2] - z) <= 0.5 * width_mm][:, :2]
    return inside


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


def _quantile(values: FloatArray, weights: FloatArray, fraction: float) -> float:
    """The value below which that fraction of the weight lies."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][int(np.searchsorted(total, fraction * total[-1]))])
