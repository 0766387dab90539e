"""Models and scenarios that mean nothing, or not what their writer thinks: a sentence, not a number."""

import numpy as np
import pytest

from glisson.core import BadInput, ContactLaw, Material, Model, Move, Scenario, Stage, Status, TetMesh
from glisson.core.scenario import LeverDrive
from glisson.core.tools import Board, Lever, Slot
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters

DOWN = np.array([0.0, 0.0, -1.0])
SOFT = Material("neo-hookean", 10.0, 0.45)
BOX = box_mesh((40.0, 30.0, 20.0), (4, 3, 2))
FREE = ContactLaw()


def at(mesh: TetMesh, x: float) -> np.ndarray:
    return np.flatnonzero(np.abs(mesh.nodes[:, 0] - x) < 1e-9)


def model_of(mesh: TetMesh, **sets) -> Model:
    return Model(mesh, {0: SOFT}, {0: "block"}, {"back": at(mesh, 0.0)} | sets)


HANG = Stage("hang", FREE)


def solved(model: Model, stage: Stage = HANG, element: str = "T4", **scenario):
    loads = {"surgery_gravity": DOWN, "rest_shape": "as-scanned"} | scenario
    return QuasiStatic(QuasiStaticParameters(element=element)).solve(model, Scenario((), (stage,), **loads))


def test_a_mask_is_no_list_of_nodes() -> None:
    with pytest.raises(BadInput, match="node set back must hold numbers, not true and false"):
        model_of(BOX, back=BOX.nodes[:, 0] == 0.0)


@pytest.mark.parametrize("first", ["tip", "half"])
def test_nodes_with_two_goals_are_refused(first: str) -> None:
    model = model_of(BOX, tip=at(BOX, 40.0), half=np.flatnonzero(BOX.nodes[:, 0] >= 20.0))
    moves = (Move("tip", (5.0, 0.0, 0.0)), Move("half", (0.0, 0.0, 0.0)))
    with pytest.raises(BadInput, match=r"holds its node at \(40, .* in another way"):
        solved(model, Stage("pull", FREE, moves=moves if first == "tip" else moves[::-1]))


def test_what_is_fixed_is_not_moved() -> None:
    with pytest.raises(BadInput, match="both fixes and moves node set 'back'"):
        Stage("pull", FREE, moves=(Move("back", (0.0, -5.0, 0.0)),))
    with pytest.raises(BadInput, match="holds its node at"):
        solved(
            model_of(BOX, most=np.arange(50)),
            Stage("pull", FREE, fixed=("back",), moves=(Move("most", (0.0, 0.0, 5.0)),)),
        )


def test_an_empty_set_is_not_moved() -> None:
    with pytest.raises(BadInput, match="which is empty"):
        solved(model_of(BOX, none=np.zeros(0, dtype=int)), Stage("pull", FREE, moves=(Move("none", (1.0, 0.0, 0.0)),)))


def test_a_stage_that_fixes_everything_is_refused() -> None:
    with pytest.raises(BadInput, match="fixes all nodes"):
        solved(model_of(BOX, all=np.arange(len(BOX.nodes))), Stage("s", FREE, fixed=("all",)))


@pytest.mark.parametrize("copies", [slice(None), slice(0, 20), slice(-1, None)])
def test_elements_that_are_there_twice_are_refused(copies: slice) -> None:
    count = len(BOX.tetrahedra[copies])
    mesh = TetMesh(BOX.nodes, np.vstack([BOX.tetrahedra, np.roll(BOX.tetrahedra[copies], 2, axis=1)[:, [0, 1, 2, 3]]]))
    with pytest.raises(BadInput, match=f"^{count} tetrahedra are there twice"):
        solved(model_of(mesh))


@pytest.mark.parametrize("element", ["T4", "T10"])
def test_nodes_without_an_element_are_refused(element: str) -> None:
    mesh = TetMesh(np.vstack([BOX.nodes, [[100.0, 0.0, 0.0]]]), BOX.tetrahedra)
    with pytest.raises(BadInput, match=r"1 nodes of the mesh belong to no tetrahedron, the first at \(100, 0, 0\) mm"):
        solved(model_of(mesh), element=element)


def test_a_mesh_without_elements_is_refused() -> None:
    with pytest.raises(BadInput, match="at least one tetrahedron"):
        TetMesh(BOX.nodes, np.zeros((0, 4), dtype=int))


def test_middle_nodes_in_another_order_are_refused() -> None:
    quadratic = BOX.as_quadratic()
    swapped = TetMesh(quadratic.nodes, quadratic.tetrahedra[:, [0, 1, 2, 3, 4, 6, 5, 7, 8, 9]])
    with pytest.raises(BadInput, match=f"{len(BOX.tetrahedra)} quadratic tetrahedra are folded"):
        solved(model_of(swapped), element="T10")
    nodes = quadratic.nodes.copy()
    nodes[-1] += [0.0, 30.0, 0.0]
    with pytest.raises(BadInput, match="folded"):
        solved(model_of(TetMesh(nodes, quadratic.tetrahedra)), element="T10")


@pytest.mark.parametrize(
    ("values", "words"),
    [(("10", 0.45), "numbers, not by '10'"), ((10.0, 0.49999999999), "at most 0.499999"), ((True, 0.4), "numbers")],
)
def test_materials_that_cannot_be_used(values, words) -> None:
    with pytest.raises(BadInput, match=words):
        Material("neo-hookean", *values)


def test_a_text_is_no_list_of_node_sets() -> None:
    with pytest.raises(BadInput, match="fixed is a list of node sets, not the text 'back'"):
        Stage("s", FREE, fixed="back")


@pytest.mark.parametrize("stiff_kpa", [1e5, 2e8, 1e11])
def test_a_stiff_part_does_not_hide_what_a_soft_one_lacks(stiff_kpa: float) -> None:
    """A soft cantilever on a root that hardly deforms: the same answer whatever the root's stiffness, or a status."""
    box = box_mesh((60.0, 20.0, 20.0), (6, 2, 2))
    root = (box.nodes[box.corners].mean(axis=1)[:, 0] < 10.0).astype(int)
    mesh = TetMesh(box.nodes, box.tetrahedra, root)
    materials = {0: SOFT, 1: Material("neo-hookean", stiff_kpa, 0.3)}
    found = solved(Model(mesh, materials, {0: "soft", 1: "stiff"}, {"back": at(mesh, 0.0)}), element="T10")
    if found.status is Status.CONVERGED:
        assert np.abs(found.displacement).max() == pytest.approx(26.563, abs=0.01)
    else:
        assert stiff_kpa > 1e9


@pytest.mark.parametrize("empty", [False, True])
def test_an_organ_that_nothing_holds_is_not_called_too_soft(empty: bool) -> None:
    model = model_of(BOX, **({"back": np.zeros(0, dtype=int)} if empty else {}))
    stage = Stage("s", FREE, fixed=("back",) if empty else ())
    found = solved(model, stage, rest_shape="from-gravity", scan_gravity=DOWN)
    assert found.status is Status.SINGULAR
    assert "not held against sliding" in found.message


def test_an_organ_on_a_slotted_board_is_at_rest_in_the_scanned_shape() -> None:
    """The same loads in scan and surgery move nothing, though the block lies over the slot and its rounded rim."""
    block = box_mesh((60.0, 30.0, 16.0), (6, 3, 2))
    slot = Slot(np.array([45.0, 15.0, 0.0]), np.array([1.0, 0.0, 0.0]), 60.0, 20.0)
    board = Board("board", np.zeros(3), -DOWN, slot=slot)
    stages = (Stage("1", ContactLaw(0.2)), Stage("2", ContactLaw(0.2)))
    scenario = Scenario((board,), stages, scan_gravity=DOWN, surgery_gravity=DOWN, scan_supports=("board",))
    found = QuasiStatic(QuasiStaticParameters()).solve(model_of(block), scenario)
    assert found.status is Status.CONVERGED
    assert np.abs(found.displacement).max() < 1e-6


@pytest.mark.parametrize("angle_deg", [8.0, -8.0])
def test_a_lever_that_turns_away_is_told(angle_deg: float) -> None:
    """A block of next to no weight rests on it at first, which is less than touching it."""
    block = box_mesh((60.0, 30.0, 16.0), (6, 3, 2))
    light = Model(block, {0: Material("neo-hookean", 10.0, 0.45, 1.0)}, {0: "block"}, {"back": at(block, 0.0)})
    lever = Lever.lifting("lever", np.array([70.0, 15.0, 0.0]), np.array([-1.0, 0.0, 0.0]), -DOWN, length_mm=40.0)
    stages = (Stage("rest", FREE), Stage("lift", FREE, drives=(LeverDrive("lever", angle_deg=angle_deg),)))
    scenario = Scenario((lever,), stages, surgery_gravity=DOWN, rest_shape="as-scanned")
    found = QuasiStatic(QuasiStaticParameters(element="T4")).solve(light, scenario)
    if angle_deg > 0.0:
        assert found.status is Status.CONVERGED
    else:
        assert found.status is Status.BAD_INPUT
        assert "Lever 'lever' never touched the organ" in found.message
