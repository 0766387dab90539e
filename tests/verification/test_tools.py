"""Boards with a slot, cylinders and mesh tools, and stages that carry them."""

import numpy as np
import pytest

from glisson.core import (
    BadInput,
    Board,
    ContactLaw,
    Cylinder,
    Lever,
    LeverDrive,
    Material,
    MeshTool,
    Scenario,
    Slot,
    Stage,
    Status,
    ToolMotion,
    TriangleSurface,
)
from glisson.core.units import STANDARD_GRAVITY_MM_S2
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.tools import make_tool
from glisson.verification.bodies import box_model

SIZES = np.array([60.0, 30.0, 15.0])
MATERIAL = Material("neo-hookean", 20.0, 0.4)
UP = np.array([0.0, 0.0, 1.0])
STICKY = ContactLaw(0.4)


def _model(counts=(6, 4, 2)):
    mesh = box_mesh(SIZES, counts)
    return box_model(mesh, MATERIAL, left=np.flatnonzero(mesh.nodes[:, 0] == 0.0))


def _solved(tools, *stages, counts=(6, 4, 2), **scenario):
    made = Scenario(tuple(tools), stages, **{"rest_shape": "as-scanned", **scenario})
    return QuasiStatic(QuasiStaticParameters(element="T4")).solve(_model(counts), made)


def _box(low, high) -> TriangleSurface:
    mesh = box_mesh(np.asarray(high) - low, (1, 1, 1))
    return TriangleSurface(mesh.nodes + low, mesh.boundary()[0])


def test_a_lever_made_of_triangles_lifts_as_a_lever_does() -> None:
    """The same bar as a box with a skin of the edges' radius, turned about the same hinge: the same answer."""
    lever = Lever.lifting("bar", np.array([25.0, 15.0, -0.4]), np.array([1.0, 0.0, 0.0]), UP, length_mm=50.0)
    half = np.array([lever.length_mm, lever.width_mm, lever.thickness_mm]) / 2.0 - lever.edge_radius_mm
    centre = lever.hinge_mm + [lever.length_mm / 2.0, 0.0, -lever.thickness_mm / 2.0]
    bar = MeshTool("bar", _box(centre - half, centre + half), lever.edge_radius_mm)
    held = {"gravity": False, "fixed": ("left",)}
    hinge = tuple(lever.hinge_mm.tolist())
    turn = tuple((12.0 * lever.axis).tolist())
    one = _solved([lever], Stage("lift", STICKY, (LeverDrive("bar", angle_deg=12.0),), **held))
    other = _solved([bar], Stage("lift", STICKY, motions=(ToolMotion("bar", turn_deg=turn, about_mm=hinge),), **held))
    assert one.status is other.status is Status.CONVERGED, other.message
    np.testing.assert_allclose(other.displacement, one.displacement, atol=1e-4)
    forces = [np.array(answer.stages[0].contacts[0].force_n) for answer in (one, other)]
    np.testing.assert_allclose(forces[1], forces[0], rtol=1e-3, atol=1e-6)
    assert np.linalg.norm(forces[0]) > 0.01


def test_a_bar_presses_a_block_on_a_board_with_what_the_board_bears() -> None:
    """Pressed down and drawn along in two stages: the forces of bar, board and weight balance, and friction drags."""
    bar = Cylinder("bar", np.array([30.0, -20.0, 19.2]), np.array([30.0, 50.0, 19.2]), 4.0)
    board = Board("board", np.array([0.0, 0.0, -0.05]), UP)
    weight = 1e-12 * MATERIAL.density_kg_m3 * STANDARD_GRAVITY_MM_S2 * SIZES.prod()  # N
    answer = _solved(
        [board, bar],
        Stage("press", STICKY, fixed=(), motions=(ToolMotion("bar", (0.0, 0.0, -2.0)),)),
        Stage("draw", STICKY, fixed=(), motions=(ToolMotion("bar", (1.0, 0.0, 0.0)),)),
        Stage("away", STICKY, fixed=(), motions=(ToolMotion("bar", (0.0, 0.0, 6.0)),)),
        surgery_gravity=-UP,
    )
    assert answer.status is Status.CONVERGED, answer.message
    for stage in answer.stages:
        bear, press = (np.array(contact.force_n) for contact in stage.contacts)
        np.testing.assert_allclose(bear + press - [0.0, 0.0, weight], 0.0, atol=2e-5)
    pressed, drawn, away = (np.array(stage.contacts[1].force_n) for stage in answer.stages)
    assert pressed[2] < -3.0 * weight
    assert drawn[0] > 0.05 * -drawn[2]
    assert np.linalg.norm(drawn[:2]) <= 0.4 * -drawn[2] * 1.02
    assert not away.any()
    assert [event.sentence for event in answer.events] == ["Lost contact with bar."]


def test_a_block_hangs_into_the_slot_of_its_board() -> None:
    """The board bears the whole weight beside the slot, over which the underside lies lower than elsewhere."""
    slot = Slot(np.array([30.0, 15.0, 0.0]), np.array([0.0, 1.0, 0.0]), 100.0, 24.0)
    board = Board("board", np.array([0.0, 0.0, -0.05]), UP, slot=slot)
    answer = _solved([board], Stage("lie", STICKY, fixed=()), counts=(15, 4, 3), surgery_gravity=-UP)
    assert answer.status is Status.CONVERGED, answer.message
    weight = 1e-12 * MATERIAL.density_kg_m3 * STANDARD_GRAVITY_MM_S2 * SIZES.prod()
    contact = answer.stages[0].contacts[0]
    assert contact.force_n[2] == pytest.approx(weight, rel=1e-3)
    assert contact.area_mm2 < SIZES[0] * SIZES[1] - 24.0 * SIZES[1] + 1.0
    mesh = answer.mesh
    under = mesh.nodes[:, 2] == 0.0
    middle = under & (np.abs(mesh.nodes[:, 0] - 30.0) < 5.0)
    ends = under & (np.abs(mesh.nodes[:, 0] - 30.0) > 25.0)
    assert answer.displacement[middle, 2].max() < answer.displacement[ends, 2].min() - 0.01


def test_distances_to_a_slotted_board_are_those_to_many_points_of_it() -> None:
    slot = Slot(np.array([5.0, 0.0, 0.0]), np.array([1.0, 1.0, 0.0]), 30.0, 12.0, edge_radius_mm=2.0)
    tool = make_tool(Board("board", np.array([0.0, 0.0, 0.0]), UP, slot=slot))
    grid = np.arange(-45.0, 45.1, 0.5)
    places = np.stack(np.meshgrid(grid, grid, indexing="ij"), axis=-1).reshape(-1, 2)
    places = places[(np.abs(places[:, 0]) >= 17.0) | (np.abs(places[:, 1]) >= 8.0)]
    axes = np.stack([slot.along, np.cross(UP, slot.along)])
    core = slot.centre_mm + places @ axes - 2.0 * UP  # the face of the board without its rounded rim
    rng = np.random.default_rng(0)
    points = rng.uniform([-10.0, -15.0, -1.9], [20.0, 15.0, 6.0], (300, 3))
    nearest = np.linalg.norm(points[:, None] - core[None], axis=2).min(axis=1) - 2.0
    found = tool.distance(points)
    # The core's points are half a millimetre apart.
    assert np.abs(found - nearest)[found > 0.0].max() < 0.1


def test_distances_to_a_cylinder_are_those_to_many_points_of_its_line() -> None:
    start, end = np.array([1.0, 2.0, 3.0]), np.array([5.0, 2.0, 9.0])
    bar = make_tool(Cylinder("bar", start, end, 1.5))
    points = np.random.default_rng(2).uniform(-4.0, 14.0, (60, 3))
    line = start + np.linspace(0.0, 1.0, 20001)[:, None] * (end - start)
    nearest = np.array([np.linalg.norm(line - point, axis=1).min() for point in points]) - 1.5
    assert np.abs(bar.distance(points) - nearest).max() < 1e-6
    normals, hessians = bar.derivatives(points)
    step = 1e-5
    for axis in range(3):
        ahead, behind = points + step * np.eye(3)[axis], points - step * np.eye(3)[axis]
        slope = (bar.distance(ahead) - bar.distance(behind)) / (2.0 * step)
        change = (bar.derivatives(ahead)[0] - bar.derivatives(behind)[0]) / (2.0 * step)
        assert np.abs(normals[:, axis] - slope).max() < 1e-8
        assert np.abs(hessians[:, :, axis] - change).max() < 1e-6


def test_a_tool_that_never_touches_is_told() -> None:
    bar = Cylinder("bar", np.array([30.0, -20.0, 40.0]), np.array([30.0, 50.0, 40.0]), 4.0)
    down = Stage("press", STICKY, gravity=False, fixed=("left",), motions=(ToolMotion("bar", (0.0, 0.0, -10.0)),))
    answer = _solved([bar], down)
    assert answer.status is Status.BAD_INPUT
    assert answer.message == "Tool 'bar' never touched the organ: it ends 11.0 mm away; move it further."


def test_a_tool_that_is_driven_into_a_held_part_is_told() -> None:
    """What is held cannot give way, so no stiffer contact keeps the tool out."""
    bar = Cylinder("bar", np.array([0.0, -20.0, 19.2]), np.array([0.0, 50.0, 19.2]), 4.0)
    down = Stage("press", STICKY, gravity=False, fixed=("left",), motions=(ToolMotion("bar", (0.0, 0.0, -1.0)),))
    answer = _solved([bar], down)
    assert answer.status is Status.BAD_INPUT
    assert "'bar' would cut into a part that is held fast, at (0, " in answer.message
    assert not answer.record


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: MeshTool("pad", TriangleSurface(np.eye(3), np.array([[0, 1, 2]]))), "is not closed"),
        (lambda: Cylinder("bar", np.zeros(3), np.zeros(3), 2.0), "two different ends"),
        (lambda: ToolMotion("bar", turn_deg=(0.0, 0.0, 5.0)), "needs about_mm"),
        (lambda: Slot(np.zeros(3), UP, 10.0, -1.0), "positive sizes"),
        (
            lambda: Scenario((), (Stage("press", STICKY, motions=(ToolMotion("bar"),)),)),
            "'bar', which is no cylinder or mesh tool",
        ),
    ],
)
def test_mistakes_with_tools(make, complaint) -> None:
    with pytest.raises(BadInput, match=complaint):
        make()
