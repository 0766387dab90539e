"""The organ, what lies in it and what touches it, at one moment: before (A) or at the end of a stage."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.mesh import TriangleSurface
from glisson.core.model import Model
from glisson.core.scenario import Scenario
from glisson.core.structures import Plane
from glisson.core.tools import Board, Cylinder, Lever, MeshTool, Slot
from glisson.geometry.mapping import PointMap
from glisson.geometry.planes import plane_basis
from glisson.geometry.quadratic import boundary_surface
from glisson.geometry.wire import Wire
from glisson.navigation.figures.colours import LEVER, LIVER, TUMOUR, WIRE, Rgb, kind_of, structure_colour
from glisson.navigation.rendering.bodies import Body, Palette
from glisson.navigation.rendering.shapes import lever_bar, patch, tree_tubes, tube
from glisson.navigation.wire import carried_wire

_WIRE_RADIUS_MM = 1.4
_SQUARE_MM = 25.4
"""The board's squares: one inch, as on the dissertation's checkerboard."""

_BOARD_MARGIN_MM = 22.0
_SLOT = (0.22, 0.22, 0.25)
_SUNK_MM = 1.0
"""How far the board is drawn below its place, lest it and the organ's underside shine through each other."""


@dataclass(frozen=True, eq=False)
class OrganState:
    """Outer surface in mm, displacement of its vertices (n,) in mm, material points' map (None: A), lever angles.

    `stage` is the one at whose end this is; None before all of them.
    """

    title: str
    surface: TriangleSurface
    moved_mm: FloatArray
    point_map: PointMap | None
    angles_deg: dict[str, float]
    stage: str | None = None

    def place(self, points: FloatArray) -> FloatArray:
        """Where material points (n, 3) of A are now."""
        return points if self.point_map is None else self.point_map.forward(points)


def state_before(deformation: Deformation, scenario: Scenario) -> OrganState:
    """The scanned shape A, levers at 0°."""
    surface = boundary_surface(deformation.mesh)
    angles = {tool.name: 0.0 for tool in scenario.tools if isinstance(tool, Lever)}
    return OrganState("Before (A)", surface, np.zeros(len(surface.vertices)), None, angles)


def state_after(deformation: Deformation, stage: StageResult, scenario: Scenario, title: str) -> OrganState:
    """The end of a stage; a lever whose contact was not reported stays at its driven angle or at 0°."""
    mesh = deformation.mesh
    rest, surface = boundary_surface(mesh), boundary_surface(mesh, mesh.moved(stage.displacement))
    moved = np.linalg.norm(surface.vertices - rest.vertices, axis=1)
    angles = lever_angles(deformation, stage, scenario)
    return OrganState(title, surface, moved, PointMap(mesh, stage.displacement), angles, stage.name)


def lever_angles(deformation: Deformation, stage: StageResult, scenario: Scenario) -> dict[str, float]:
    """Angle in degrees of each lever at the end of a stage: as reported, else as last driven."""
    angles = {tool.name: 0.0 for tool in scenario.tools if isinstance(tool, Lever)}
    for known in scenario.stages:
        for drive in known.drives:
            if drive.angle_deg is not None:
                angles[drive.lever] = drive.angle_deg
        if known.name == stage.name:
            break
    for result in deformation.stages:
        for contact in result.contacts:
            if contact.angle_deg is not None:
                angles[contact.tool] = contact.angle_deg
        if result.name == stage.name:
            break
    return angles


def liver_body(state: OrganState, values: FloatArray | None = None, palette: Palette | None = None) -> Body:
    """The see-through organ, coloured by values at its vertices where they are given."""
    return Body(
        state.surface.vertices, state.surface.triangles, LIVER, opacity=0.5, gloss=0.22, values=values, palette=palette
    )


def inner_bodies(state: OrganState, model: Model) -> list[Body]:
    """Tumours, vessel trees and wire where they are now."""
    bodies = []
    for tumour in model.structures.tumours:
        place = state.place(tumour.surface.vertices)
        bodies.append(Body(place, tumour.surface.triangles, TUMOUR, gloss=0.25, inner=True))
    for tree in model.structures.trees:
        mesh = tree_tubes(tree, state.place(tree.points_mm))
        bodies.append(Body(*mesh, structure_colour(tree.name), gloss=0.15, inner=True, ink=False))
    wire = wire_in(state, model)
    if wire is not None:
        bodies.append(Body(*tube(wire.points_mm, _WIRE_RADIUS_MM), WIRE, gloss=0.4, inner=True, ink=False))
    return bodies


def wire_in(state: OrganState, model: Model) -> Wire | None:
    """The wire of fixed length where it is now; None without one."""
    duct, length = model.structures.duct, model.structures.wire_length_mm
    if duct is None or length is None:
        return None
    if state.point_map is None:
        return Wire(duct.points_mm, length)
    return carried_wire(duct, length, state.point_map)[0]


def tool_bodies(state: OrganState, scenario: Scenario) -> list[Body]:
    """Moving tools where they are, and each flat board as a checkerboard of one-inch squares under the organ."""
    bodies = []
    for tool in scenario.tools:
        if isinstance(tool, Lever):
            bodies.append(Body(*lever_bar(tool, state.angles_deg[tool.name]), LEVER, smooth=False))
        elif isinstance(tool, Board):
            if not tool.conforming:
                bodies.append(_checkerboard(tool, state.surface.vertices, scenario))
            if tool.slot is not None:
                bodies.append(_opening(tool, tool.slot))
        else:
            vertices, triangles = (
                tube(np.stack([tool.start_mm, tool.end_mm]), tool.radius_mm)
                if isinstance(tool, Cylinder)
                else (tool.surface.vertices, tool.surface.triangles)
            )
            if state.stage is not None:
                vertices = scenario.tool_pose(tool.name, state.stage).apply(vertices)
            bodies.append(Body(vertices, triangles, LEVER, smooth=isinstance(tool, Cylinder)))
    return bodies


def legend(model: Model, scenario: Scenario) -> dict[str, Rgb]:
    """What is drawn besides the organ, by colour."""
    entries: dict[str, Rgb] = {}
    if model.structures.tumours:
        entries["tumour" if len(model.structures.tumours) == 1 else "tumours"] = TUMOUR
    if model.structures.duct is not None:
        entries["wire"] = WIRE
    for tree in model.structures.trees:
        entries[kind_of(tree.name)] = structure_colour(tree.name)
    if any(isinstance(tool, Lever) for tool in scenario.tools):
        entries["lever"] = LEVER
    if any(isinstance(tool, Cylinder | MeshTool) for tool in scenario.tools):
        entries["tool"] = LEVER
    return entries


def _opening(board: Board, slot: Slot) -> Body:
    """A board's slot as a dark rectangle just over the board."""
    across = np.cross(board.normal, slot.along)
    centre = slot.centre_mm - 0.9 * _SUNK_MM * board.normal
    half_along, half_across = 0.5 * slot.length_mm * slot.along, 0.5 * slot.width_mm * across
    return Body(*patch(centre, half_along, half_across), _SLOT, smooth=False)


def _checkerboard(board: Board, vertices: FloatArray, scenario: Scenario) -> Body:
    """Squares under the organ, each with vertices of its own so that their edges stay sharp."""
    arms = [tool.arm for tool in scenario.tools if isinstance(tool, Lever)]
    along = (
        np.cross(np.cross(board.normal, arms[0]), board.normal)
        if arms
        else plane_basis(Plane(board.point_mm, board.normal))[0]
    )
    u = along / np.linalg.norm(along)
    v = np.cross(board.normal, u)
    tips = [tool.hinge_mm + tool.length_mm * tool.arm for tool in scenario.tools if isinstance(tool, Lever)]
    offset = np.vstack([vertices, *tips]) - board.point_mm
    ranges = [
        (np.floor((part.min() - _BOARD_MARGIN_MM) / _SQUARE_MM), np.ceil((part.max() + _BOARD_MARGIN_MM) / _SQUARE_MM))
        for part in (offset @ u, offset @ v)
    ]
    corners: list[FloatArray] = []
    triangles, values = [], []
    for i in np.arange(*ranges[0]):
        for j in np.arange(*ranges[1]):
            centre = board.point_mm - _SUNK_MM * board.normal + _SQUARE_MM * ((i + 0.5) * u + (j + 0.5) * v)
            square, pair = patch(centre, 0.5 * _SQUARE_MM * u, 0.5 * _SQUARE_MM * v, steps=3)
            triangles.append(pair + len(square) * len(corners))
            corners.append(square)
            values.append(np.full(len(square), float((i + j) % 2)))
    return Body(
        np.vstack(corners),
        np.vstack(triangles),
        smooth=False,
        values=np.concatenate(values),
        palette=lambda value: np.where(
            value[:, None] > 0.5, np.array([0.97, 0.97, 0.98]), np.array([0.84, 0.85, 0.88])
        ),
    )
