"""The deck writer and the result reader, with CalculiX itself: closed forms and CalculiX's own test."""

import numpy as np
import pytest

from glisson.core import Lever, Material, TetMesh
from glisson.core.mesh import TET_FACES
from glisson.core.units import STANDARD_GRAVITY_MM_S2
from glisson.geometry.boxes import box_mesh
from glisson.phantom.calculix.deck import FACE_OPPOSITE_CORNER, Deck, Increments, PenaltyContact
from glisson.phantom.calculix.lift_deck import LiftOrgan, LiftSettings, with_middles, write_lift_deck
from glisson.phantom.calculix.results import calculix_program, read_frd, run_calculix
from glisson.verification.calculix_files import fields, read_displacements, read_t10
from glisson.verification.closed_forms import uniaxial

needs_calculix = pytest.mark.skipif(calculix_program() is None, reason="CalculiX (ccx) is not installed")


@needs_calculix
def test_uniaxial_stretch_of_a_neo_hookean_block(tmp_path):
    mesh = box_mesh((10.0, 10.0, 20.0), (1, 1, 2), quadratic=True)
    material = Material("neo-hookean", 7.0, 0.45)
    stretch = 1.3
    deck = Deck("uniaxial")
    nodes, _ = deck.add_mesh(mesh, "BLOCK")
    deck.neo_hooke("TISSUE", "EBLOCK", material)
    x, y, z = mesh.nodes.T
    for axis, plane in enumerate((x, y, z), start=1):
        deck.node_set(f"FACE{axis}", np.flatnonzero(plane == 0.0))
        deck.raw("*BOUNDARY", f"FACE{axis},{axis},{axis}")
    top = np.flatnonzero(z == 20.0)
    deck.begin_step(Increments(first=0.5))
    deck.raw("*BOUNDARY", *(f"{nodes[n] + 1},3,3,{20.0 * (stretch - 1.0)}" for n in top))
    deck.end_step(["U", "RF"])
    path = tmp_path / "block.inp"
    path.write_text(deck.text)
    assert run_calculix(path)
    moved = read_frd(tmp_path / "block.frd", "DISP")[-1]
    force = read_frd(tmp_path / "block.frd", "FORC")[-1]
    np.testing.assert_array_equal(moved.nodes, nodes)
    lateral, stress = uniaxial(stretch, material)
    assert (moved.values[:, 0] + x)[x == 10.0] == pytest.approx(10.0 * lateral, rel=1e-4)
    assert force.values[top, 2].sum() == pytest.approx(stress * 100.0, rel=1e-4)


@needs_calculix
def test_block_on_a_board_carries_its_weight_and_slips_at_the_friction_angle(tmp_path):
    """Gravity, contact, friction and a prescribed tool in one: a block pulled over a board by a handle."""
    mesh = box_mesh((20.0, 10.0, 20.0), (2, 1, 2), quadratic=True)
    density, friction = 1150.0, 0.3
    deck = Deck("block on a board")
    _, elements = deck.add_mesh(mesh, "BLOCK")
    deck.neo_hooke("TISSUE", "EBLOCK", Material("neo-hookean", 500.0, 0.3, density))
    board = deck.add_nodes(np.array([[x, y, z] for y in (-5.0, 0.0) for x, z in _SQUARE]), "NBOARD")
    brick = deck.add_elements("C3D8", board[None, [3, 2, 1, 0, 7, 6, 5, 4]], "EBOARD")
    deck.elastic("WOOD", "EBOARD", Material("linear-elastic", 1e4, 0.3, 0.0))
    deck.fix("NBOARD")
    faces, owners = mesh.boundary()
    below = mesh.nodes[faces][..., 1].max(axis=1) == 0.0
    opposite = [int(np.flatnonzero(~np.isin(mesh.corners[e], f))[0]) for f, e in zip(faces, owners, strict=True)]
    deck.surface("SBLOCK", elements[owners[below]], FACE_OPPOSITE_CORNER[opposite][below])
    deck.surface("SBOARD", brick, np.array([2]))
    deck.contact("TOUCH", PenaltyContact(500.0, 50.0, friction), [("SBLOCK", "SBOARD")])
    side = np.flatnonzero(mesh.nodes[:, 0] == 20.0)
    deck.node_set("HANDLE", side)
    deck.raw("*BOUNDARY", "HANDLE,1,1", "HANDLE,3,3")
    deck.begin_step(Increments(first=0.25))
    deck.gravity("EBLOCK", np.array([0.0, -1.0, 0.0]))
    deck.end_step(["U", "RF"])
    deck.begin_step(Increments(first=0.1))
    deck.raw("*BOUNDARY", "HANDLE,1,1,2.0")
    deck.end_step(["U", "RF"])
    path = tmp_path / "slide.inp"
    path.write_text(deck.text)
    assert run_calculix(path)
    forces = read_frd(tmp_path / "slide.frd", "FORC")
    weight = 20.0 * 10.0 * 20.0 * density * 1e-9 * STANDARD_GRAVITY_MM_S2
    # The board is pressed down by the weight in both steps, and dragged along by µ times it in the second.
    assert forces[0].values[board, 1].sum() == pytest.approx(weight, rel=1e-3)
    assert forces[1].values[board, 1].sum() == pytest.approx(weight, rel=1e-3)
    assert abs(forces[1].values[board, 0].sum()) == pytest.approx(friction * weight, rel=0.01)


_SQUARE = [(-30.0, -30.0), (60.0, -30.0), (60.0, 60.0), (-30.0, 60.0)]


@needs_calculix
def test_calculix_own_t10_beam_survives_our_writer(shared_data, tmp_path):
    """beam10p of CalculiX's test suite, its mesh written by us, its displacements compared with upstream's."""
    folder = shared_data / "open" / "calculix-tests"
    source = (folder / "beam10p.inp").read_text().splitlines()
    read = read_t10(source)
    deck = Deck("beam10p")
    deck.add_mesh(read.mesh, "ALL")
    rest = _renumbered_rest(source, read.order)
    path = tmp_path / "beam.inp"
    path.write_text(deck.text + "\n".join(rest) + "\n")
    assert run_calculix(path)
    numbers, expected = read_displacements((folder / "beam10p.dat.ref").read_text().splitlines())
    ours, moved = read_displacements(path.with_suffix(".dat").read_text().splitlines())
    assert len(numbers) == len(read.numbers)
    rows = np.searchsorted(ours, [read.order[int(number)] + 1 for number in numbers])
    apart = np.linalg.norm(moved[rows] - expected, axis=1).max()
    assert apart < 1e-5 * np.linalg.norm(expected, axis=1).max()


def test_face_numbers_are_calculix_own():
    """S1 = 1-2-3, S2 = 1-4-2, S3 = 2-4-3, S4 = 3-4-1 in CalculiX's manual."""
    manual = {1: {1, 2, 3}, 2: {1, 4, 2}, 3: {2, 4, 3}, 4: {3, 4, 1}}
    for corner in range(4):
        assert manual[int(FACE_OPPOSITE_CORNER[corner])] == {int(n) + 1 for n in TET_FACES[corner]}


def test_lift_deck_names_what_a_lift_needs(tmp_path):
    mesh = box_mesh((80.0, 30.0, 60.0), (4, 2, 3), quadratic=True)
    organ_mesh = TetMesh(mesh.nodes - [0.0, 30.0, 30.0], mesh.tetrahedra)
    held = np.flatnonzero(organ_mesh.nodes[: int(mesh.corners.max()) + 1, 0] == 0.0)
    organ = LiftOrgan(organ_mesh, np.linspace(6.0, 8.0, len(mesh.tetrahedra)), 0.45, 1150.0, held)
    lever = Lever.lifting("lever", np.array([20.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]))
    steps = write_lift_deck(tmp_path / "lift.inp", organ, lever, LiftSettings(11.0))
    text = (tmp_path / "lift.inp").read_text()
    assert text.count("*STEP") == text.count("*END STEP") == steps.stage2
    assert steps.stage1 == 3
    assert text.count("*CHANGE FRICTION") == 1 + steps.stage2 - steps.stage1
    # Held are exactly the corners and middle nodes of the face x = 0.
    np.testing.assert_array_equal(with_middles(organ_mesh, held), np.flatnonzero(organ_mesh.nodes[:, 0] == 0.0))


def _renumbered_rest(lines, nodes):
    """Everything after the mesh, with our numbers; our sets NALL and EALL are called as upstream's."""
    start = next(i for i, line in enumerate(lines) if line.startswith("*ELEMENT"))
    start += 1 + next(i for i, line in enumerate(lines[start + 1 :]) if line.startswith("*"))
    rest, mode = [], ""
    for line in lines[start:]:
        if line.startswith("*"):
            mode = line.split(",")[0].upper().strip()
        renumbered = mode in ("*BOUNDARY", "*NSET") and not line.startswith("*")
        rest.append(_renumbered_line(line, mode, nodes) if renumbered else line)
    return rest


def _renumbered_line(line, mode, nodes):
    values = fields(line)
    count = len(values) if mode == "*NSET" else 1
    return ",".join(str(nodes[int(v)] + 1) if v.isdigit() and k < count else v for k, v in enumerate(values))
