"""The same problems solved by CalculiX (Dhondt, CalculiX CrunchiX), and its own published results.

CalculiX's C3D4 and C3D10 have our shape functions and quadrature, so that without contact the two must agree to the
digits of its result file. It is a program of its own, run where it is installed.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.scenario import ContactLaw
from glisson.geometry.boxes import box_mesh
from glisson.mechanics.contact_law import Cushion
from glisson.phantom.calculix.deck import FACE_OPPOSITE_CORNER, Deck, Increments, PenaltyContact
from glisson.phantom.calculix.results import NodalField, calculix_program, read_frd, run_calculix
from glisson.verification.bodies import body_of, equilibrium, floor, reactions
from glisson.verification.calculix_files import cards, fields, node_sets, read_displacements, read_t10
from glisson.verification.check import Case, Check, NoSolution, Unavailable, relative, vanishing
from glisson.verification.shared_data import shared_folder

_SOURCE = "CalculiX on the same mesh"


def _solved(deck: Deck, names: Sequence[str]) -> dict[str, list[NodalField]]:
    """The deck's result fields by name, each at the end of every step.

    Raises:
        Unavailable: CalculiX is not installed.
        NoSolution: it did not converge.
    """
    if calculix_program() is None:
        raise Unavailable("CalculiX (ccx) is not installed; on Debian or Ubuntu: apt install calculix-ccx")
    with TemporaryDirectory(prefix="glisson-verify-") as folder:
        path = Path(folder) / "deck.inp"
        path.write_text(deck.text)
        if not run_calculix(path):
            raise NoSolution("CalculiX did not converge")
        return {name: read_frd(path.with_suffix(".frd"), name) for name in names}


def _bent(name: str, quadratic: bool) -> list[Check]:
    """A soft cantilever that dead forces at its end bend by more than its height."""
    mesh = box_mesh((60.0, 12.0, 15.0), (10, 2, 3), quadratic)
    material = Material("neo-hookean", 7.0, 0.45)
    root = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    end = np.flatnonzero(mesh.nodes[:, 0] > 60.0 - 1e-9)
    force = np.array([0.0, 3.0, -24.0]) / len(end)
    deck = Deck("cantilever")
    deck.add_mesh(mesh, "BEAM")
    deck.neo_hooke("TISSUE", "EBEAM", material)
    deck.node_set("ROOT", root)
    deck.node_set("END", end)
    deck.fix("ROOT")
    deck.begin_step(Increments(first=0.25))
    deck.residual(1e-6)
    deck.raw("*CLOAD", *(f"END,{axis},{value:.12g}" for axis, value in enumerate(force, start=1)))
    deck.end_step(["U", "RF"])
    theirs = _solved(deck, ["DISP", "FORC"])
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[root] = True
    body = body_of(mesh, material, fixed)
    loads = np.zeros_like(mesh.nodes)
    loads[end] = force
    positions = np.array(mesh.nodes)
    for share in (0.25, 0.5, 0.75, 1.0):
        body.external = share * loads
        positions = equilibrium(body, positions)
    moved, expected = positions - mesh.nodes, theirs["DISP"][-1].values
    ours, reaction = reactions(body, positions), theirs["FORC"][-1].values[root]
    turning = np.cross(positions[root], ours[root]).sum(axis=0)[1]
    expected_turning = np.cross(mesh.nodes[root] + expected[root], reaction).sum(axis=0)[1]
    tip = int(np.linalg.norm(mesh.nodes - [60.0, 6.0, 7.5], axis=1).argmin())
    return [
        vanishing(f"{name}/displacements", _apart(moved, expected), 0.01, "", _SOURCE),
        relative(f"{name}/tip", moved[tip, 2], expected[tip, 2], 0.01, "mm", _SOURCE),
        relative(f"{name}/clamping-moment", turning, expected_turning, 0.01, "mN mm", _SOURCE),
    ]


def _apart(found: FloatArray, expected: FloatArray) -> float:
    """Relative difference in the L2 norm over nodes."""
    return float(np.linalg.norm(found - expected) / np.linalg.norm(expected))


_PRESS, _DRAGS = 1.0, (0.3, 0.6, 2.0)  # of the block's upper face, mm
_FRICTION = 0.3


def _dragged(name: str, quadratic: bool) -> list[Check]:
    """A block that is pressed on a board and then dragged, first slipping at its edge only, at last everywhere."""
    mesh = box_mesh((30.0, 20.0, 15.0), (6, 4, 3), quadratic)
    material = Material("neo-hookean", 50.0, 0.3)
    upper = np.flatnonzero(mesh.nodes[:, 2] > 15.0 - 1e-9)
    theirs = _dragged_by_calculix(mesh, material, upper)
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[upper] = True
    # As stiff as CalculiX's: both let the block sink in by some hundredths of a millimetre, and stick as firmly.
    body = body_of(mesh, material, fixed, boards=[floor(-0.01)], cushion=Cushion(0.01, 5e4), stick_mm=0.005)
    body.law = ContactLaw(_FRICTION)
    ways = [np.array([0.0, 0.0, -share * _PRESS]) for share in (0.25, 0.5, 0.75, 1.0)]
    ways += [np.array([drag, 0.0, -_PRESS]) for drag in np.arange(0.1, _DRAGS[-1] + 1e-9, 0.1).round(9)]
    positions, checks = np.array(mesh.nodes), []
    for way in ways:
        positions = equilibrium(body, _carried(mesh, positions, upper, way), 1e-7)
        body.accept(positions)
        if way[0] in _DRAGS:
            ours, expected = -reactions(body, positions).sum(axis=0), theirs[_DRAGS.index(way[0])]
            checks += [
                relative(f"{name}/shear-{way[0]:g}mm", ours[0], expected[0], 0.03, "mN", _SOURCE),
                relative(f"{name}/pressing-{way[0]:g}mm", ours[2], expected[2], 0.03, "mN", _SOURCE),
            ]
    return checks


def _carried(mesh: TetMesh, positions: FloatArray, upper: IntArray, way: FloatArray) -> FloatArray:
    """Positions with the upper face taken to its place and the rest along in proportion to its height."""
    step = way - (positions - mesh.nodes)[upper[0]]
    carried: FloatArray = positions + mesh.nodes[:, 2:] / 15.0 * step
    carried[upper] = mesh.nodes[upper] + way
    return carried


def _dragged_by_calculix(mesh: TetMesh, material: Material, upper: IntArray) -> list[FloatArray]:
    """Force (3,) of the block on what holds its upper face, after each of `_DRAGS`."""
    deck = Deck("block dragged over a board")
    _, elements = deck.add_mesh(mesh, "BLOCK")
    deck.neo_hooke("TISSUE", "EBLOCK", material)
    square = [(-20.0, -20.0), (50.0, -20.0), (50.0, 40.0), (-20.0, 40.0)]
    board = deck.add_nodes(np.array([[x, y, z] for z in (-5.0, 0.0) for x, y in square]), "NBOARD")
    brick = deck.add_elements("C3D8", board[None, :], "EBOARD")
    deck.elastic("WOOD", "EBOARD", Material("linear-elastic", 1e4, 0.3, 0.0))
    deck.fix("NBOARD")
    faces, owners = mesh.boundary()
    below = mesh.nodes[faces][..., 2].max(axis=1) < 1e-9
    opposite = np.argmin(np.isin(mesh.corners[owners[below]], np.flatnonzero(mesh.nodes[:, 2] < 1e-9)), axis=1)
    deck.surface("SBLOCK", elements[owners[below]], FACE_OPPOSITE_CORNER[opposite])
    deck.surface("SBOARD", brick, np.array([2]))
    deck.contact("TOUCH", PenaltyContact(5000.0, 400.0, _FRICTION), [("SBLOCK", "SBOARD")])
    for drag in (0.0, *_DRAGS):
        deck.begin_step(Increments(first=0.1))
        deck.displace(upper, np.tile([drag, 0.0, -_PRESS], (len(upper), 1)))
        deck.end_step(["U", "RF"])
    forces = _solved(deck, ["FORC"])["FORC"]
    return [-field.values[upper].sum(axis=0) for field in forces[1:]]


def _beam10p(name: str) -> list[Check]:
    """CalculiX's cantilever of C3D10 elements under end forces, its mesh read as it is."""
    folder = shared_folder("open", "calculix-tests")
    lines = (folder / "beam10p.inp").read_text().splitlines()
    source = read_t10(lines)
    sets, order = node_sets(lines), source.order
    fixed = np.zeros(source.mesh.nodes.shape, dtype=bool)
    fixed[[order[number] for number in sets["FIX"]], 2] = True
    fixed[order[1], :2] = True
    fixed[order[3], 0] = True
    body = body_of(source.mesh, Material("linear-elastic", 210_000.0, 0.3), fixed)
    loads = np.zeros_like(source.mesh.nodes)
    loads[[order[number] for number in sets["LOAD"]], 1] = 1.0
    body.external = loads
    moved = equilibrium(body, np.array(source.mesh.nodes)) - source.mesh.nodes
    numbers, expected = read_displacements((folder / "beam10p.dat.ref").read_text().splitlines())
    rows = np.array([order[int(number)] for number in numbers])
    furthest = int(np.abs(expected[:, 1]).argmax())
    told = "CalculiX's published results"
    return [
        vanishing(f"{name}/displacements", _apart(moved[rows], expected), 0.01, "", told),
        relative(f"{name}/tip", moved[rows[furthest], 1], expected[furthest, 1], 0.01, "mm", told),
    ]


def _beamnh(name: str) -> list[Check]:
    """CalculiX's neo-Hookean bar under a true end stress of 2, of hexahedra there and of our T10 here.

    The bar is drawn by what CalculiX found, and must then carry that stress and be as thin.
    """
    folder = shared_folder("open", "calculix-tests")
    lines = (folder / "beamnh.inp").read_text().splitlines()
    constants = next(data for keyword, data in cards(lines) if keyword.startswith("*HYPERELASTIC"))
    first, inverse = (float(value) for value in fields(constants[0]))
    shear, bulk = 2.0 * first, 2.0 / inverse  # C10 = µ/2 and D1 = 2/κ
    young = 9.0 * bulk * shear / (3.0 * bulk + shear)
    material = Material("neo-hookean", young, young / (2.0 * shear) - 1.0)
    numbers, expected = read_displacements((folder / "beamnh.dat.ref").read_text().splitlines())
    drawn, narrowed = expected[list(numbers).index(6)][[2, 0]]
    mesh = box_mesh((1.0, 1.0, 8.0), (2, 2, 8), quadratic=True)
    end = mesh.nodes[:, 2] > 8.0 - 1e-9
    fixed = mesh.nodes < 1e-9
    fixed[end, 2] = True
    body = body_of(mesh, material, fixed)
    start = mesh.nodes * [1.0 + narrowed, 1.0 + narrowed, 1.0 + drawn / 8.0]
    positions = equilibrium(body, start)
    area = np.ptp(positions[end, 0]) * np.ptp(positions[end, 1])
    stress = reactions(body, positions)[end, 2].sum() / area
    told = "CalculiX's published results"
    return [
        relative(f"{name}/end-stress", stress, 2.0, 0.01, "kPa", told),
        relative(f"{name}/narrowing", np.ptp(positions[:, 0]) - 1.0, narrowed, 0.01, "mm", told),
    ]


CASES = (
    *(
        Case(name, f"soft cantilever bent by dead forces, {kind}, neo-Hookean", partial(_bent, name, kind == "T10"))
        for kind in ("T4", "T10")
        for name in [f"calculix/cantilever/{kind}"]
    ),
    *(
        Case(name, f"block pressed on a board and dragged, {kind}", partial(_dragged, name, kind == "T10"), slow=True)
        for kind in ("T4", "T10")
        for name in [f"calculix/friction/{kind}"]
    ),
    Case("calculix/beam10p", "CalculiX's test beam10p: cantilever, C3D10", partial(_beam10p, "calculix/beam10p")),
    Case("calculix/beamnh", "CalculiX's test beamnh: neo-Hookean bar, remeshed", partial(_beamnh, "calculix/beamnh")),
)
