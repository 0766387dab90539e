"""Capsule, gas and ligaments as a scenario and a model name them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from glisson.core import (
    BadInput,
    Capsule,
    ContactLaw,
    Curve,
    Material,
    Model,
    Move,
    Rod,
    Scenario,
    Stage,
    Status,
    Structures,
)
from glisson.core.mesh import TetMesh
from glisson.geometry.boxes import box_mesh
from glisson.geometry.mapping import PointMap
from glisson.geometry.wire import Wire
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.self_contact import SelfContact
from glisson.navigation.wire import carried_wire
from glisson.verification.bodies import box_model
from glisson.verification.closed_forms import uniaxial

SOFT = Material("neo-hookean", 7.0, 0.4)
FREE = ContactLaw()
SIZES = np.array([30.0, 20.0, 10.0])
DOWN = np.array([0.0, 0.0, -1.0])


def _model(**changes: object) -> Model:
    mesh = box_mesh(SIZES, (3, 2, 2))
    x = mesh.nodes[:, 0]
    model = box_model(mesh, SOFT, left=np.flatnonzero(x == 0.0), right=np.flatnonzero(x == SIZES[0]))
    return replace(model, **changes)


def _solved(model: Model, *stages: Stage, **scenario: object):
    made = Scenario((), stages, **{"rest_shape": "as-scanned", **scenario})
    return QuasiStatic(QuasiStaticParameters(tolerance=1e-9)).solve(model, made)


def test_an_organ_on_ligaments_stays_as_scanned_until_something_changes() -> None:
    """What ligaments bear in the scan they go on bearing, as if they were fast; without gravity they draw it up."""
    rigid = replace(SOFT, young_modulus_kpa=7e3)
    model = replace(_model(ligaments={"left": 5.0, "right": 5.0}), materials={0: rigid})
    loads = {"rest_shape": "from-gravity", "scan_gravity": DOWN, "surgery_gravity": DOWN}
    answer = _solved(model, Stage("still", FREE, fixed=()), Stage("weightless", FREE, fixed=(), gravity=False), **loads)
    assert answer.status is Status.CONVERGED, answer.message
    np.testing.assert_allclose(answer.stages[0].displacement, 0.0, atol=1e-6)
    # The springs rise by the weight over their stiffness.
    weight = 1150e-9 * 9.80665e3 * SIZES.prod()  # mN
    mesh = answer.mesh
    side = mesh.nodes[:, 0] == 0.0
    rise = answer.stages[1].displacement[side, 2].mean()
    assert rise == pytest.approx(weight / (2.0 * 5.0 * SIZES[1] * SIZES[2]), rel=0.02)


def test_stiff_ligaments_hold_as_fixed_ones() -> None:
    pull = (Move("right", (4.0, 0.0, -3.0)),)
    fast = _solved(_model(), Stage("pull", FREE, gravity=False, fixed=("left",), moves=pull))
    stiff = _solved(_model(ligaments={"left": 1e6}), Stage("pull", FREE, gravity=False, fixed=(), moves=pull))
    assert fast.status is stiff.status is Status.CONVERGED
    np.testing.assert_allclose(stiff.displacement, fast.displacement, atol=1e-4)


def test_gas_comes_and_goes() -> None:
    """Let out, the organ is as it was; while it presses the mean squeeze is that of the bulk modulus."""
    quiet = {"gravity": False, "fixed": ("left",)}
    answer = _solved(_model(), Stage("in", FREE, gas_pressure_kpa=1.6, **quiet), Stage("out", FREE, **quiet))
    assert answer.status is Status.CONVERGED
    np.testing.assert_allclose(answer.displacement, 0.0, atol=1e-6)
    mesh = answer.mesh
    squeezed = TetMesh(mesh.nodes + answer.stages[0].displacement, mesh.tetrahedra)
    # A held end lets an even squeeze through only in part.
    lost = 1.0 - squeezed.volume_mm3 / mesh.volume_mm3
    assert 0.7 < lost / (1.6 / SOFT.bulk_modulus_kpa) < 1.0


def test_a_capsule_bears_its_share_of_a_pull() -> None:
    """A bar of next to nothing in a skin stores what the skin stores.

    That lies between a skin that narrows freely and one that cannot.
    """
    skin = Capsule(young_modulus_kpa=300.0, thickness_mm=0.1)
    stretch = 1.1
    faint = replace(SOFT, young_modulus_kpa=1e-2, poisson_ratio=0.0)
    model = replace(_model(), materials={0: faint}, capsule=skin)
    moves = (Move("right", ((stretch - 1.0) * SIZES[0], 0.0, 0.0)),)
    answer = _solved(model, Stage("pull", FREE, gravity=False, fixed=("left",), moves=moves))
    assert answer.status is Status.CONVERGED, answer.message
    scale = 0.5 * 100.0 * 0.1 * 2.0 * SIZES[0] * (SIZES[1] + SIZES[2])
    free, stiff = stretch**2 + 2.0 / stretch - 3.0, stretch**2 + stretch**-2 - 2.0
    assert free < answer.record[-1].energy_uj / scale < stiff


def _with_duct(rod: Rod | None) -> Model:
    duct = Curve(np.array([[0.0, 10.0, 5.0], [10.0, 12.0, 5.0], [20.0, 9.0, 4.0], [30.0, 10.0, 5.0]]))
    return _model(structures=Structures(duct=duct, wire_length_mm=25.0), rod=rod)


def test_a_wire_of_fixed_length_slides_as_the_duct_shortens() -> None:
    """Held at the mouth and hardly to be stretched, its tip goes where a curve of that length in the duct ends."""
    squeeze = Stage("squeeze", FREE, gravity=False, fixed=("left",), moves=(Move("right", (-3.0, 2.0, 0.0)),))
    answer = _solved(_with_duct(Rod(0.0, axial_stiffness_n=1e3)), squeeze)
    assert answer.status is Status.CONVERGED, answer.message
    structures = _with_duct(None).structures
    point_map = PointMap(answer.mesh, answer.displacement)
    assert structures.duct is not None
    tip = carried_wire(structures.duct, 25.0, point_map)[0].points_mm[-1]
    # Where the tip was in A tells how far it slid past the tissue.
    arcs, _ = Wire(structures.duct.points_mm, 30.0).project(point_map.back(tip[None]))
    slide = answer.stages[-1].rod.slide_mm
    assert slide == pytest.approx(arcs[0] - 25.0, abs=0.1)
    assert slide > 1.5


def test_a_stiff_stent_bends_less_than_the_duct_would() -> None:
    """The organ with a rod in it gives way less, and in the scan it is in equilibrium with the bent rod."""
    bend = (Stage("still", FREE, gravity=False, fixed=("left",)), Stage("hang", FREE, fixed=("left",)))
    loads = {"rest_shape": "from-gravity", "surgery_gravity": DOWN}
    answers = [_solved(_with_duct(rod), *bend, **loads) for rod in (None, Rod(2.0), Rod(10.0))]
    free = answers[0].mesh.nodes[:, 0] == SIZES[0]
    for answer in answers:
        assert answer.status is Status.CONVERGED, answer.message
        np.testing.assert_allclose(answer.stages[0].displacement, 0.0, atol=1e-6)
    sags = [-answer.displacement[free, 2].mean() for answer in answers]
    assert 0.0 < sags[2] < sags[1] < sags[0]
    assert answers[0].stages[-1].rod is None


def test_friction_keeps_a_wire_from_sliding() -> None:
    squeeze = Stage("squeeze", FREE, gravity=False, fixed=("left",), moves=(Move("right", (-1.0, 0.0, 0.0)),))
    slides = [
        _solved(_with_duct(Rod(0.0, axial_stiffness_n=0.2, grip_n_mm=grip)), squeeze).stages[-1].rod.slide_mm
        for grip in (0.0, 0.002, 0.02)
    ]
    assert slides[0] > slides[1] > slides[2] > 0.0
    assert slides[2] < 0.5 * slides[0]


def test_a_rod_without_a_duct_is_refused() -> None:
    with pytest.raises(BadInput, match="needs a duct to lie in"):
        _model(rod=Rod(1.0))


def test_regions_of_two_laws_in_series_share_one_pull() -> None:
    """A bar of a soft neo-Hookean and a stiffer Mooney–Rivlin half: the border goes where both pulls are equal."""
    mesh = box_mesh((40.0, 10.0, 10.0), (8, 2, 2))
    centres = mesh.nodes[mesh.corners].mean(axis=1)
    x = mesh.nodes[:, 0]
    soft = Material("neo-hookean", 7.0, 0.0)
    stiff = Material("mooney-rivlin", 21.0, 0.0, constants=(0.3,))
    model = Model(
        TetMesh(mesh.nodes, mesh.tetrahedra, (centres[:, 0] > 20.0).astype(np.int64)),
        {0: soft, 1: stiff},
        {0: "soft", 1: "stiff"},
        {"left": np.flatnonzero(x == 0.0), "right": np.flatnonzero(x == 40.0)},
    )
    moves = (Move("right", (6.0, 0.0, 0.0)),)
    answer = _solved(model, Stage("pull", FREE, gravity=False, fixed=("left",), moves=moves))
    assert answer.status is Status.CONVERGED
    border = (20.0 + answer.displacement[answer.mesh.nodes[:, 0] == 20.0, 0]).mean()

    def excess(place: float) -> float:
        return uniaxial(place / 20.0, soft)[1] - uniaxial((46.0 - place) / 20.0, stiff)[1]

    assert border - 20.0 == pytest.approx(brentq(excess, 20.0, 26.0) - 20.0, rel=0.01)


def _tied(counts: tuple[int, int, int]) -> Model:
    """A bar of two boxes side by side along x, each with nodes of its own on the face between them."""
    first, second = box_mesh((15.0, 20.0, 10.0), (3, 4, 2)), box_mesh((15.0, 20.0, 10.0), counts)
    nodes = np.vstack([first.nodes, second.nodes + [15.0, 0.0, 0.0]])
    mesh = TetMesh(nodes, np.vstack([first.tetrahedra, second.tetrahedra + len(first.nodes)]))
    own = np.arange(len(nodes)) < len(first.nodes)
    x = nodes[:, 0]
    return box_model(
        mesh,
        SOFT,
        left=np.flatnonzero(x == 0.0),
        right=np.flatnonzero(x == 30.0),
        face=np.flatnonzero(own & (x == 15.0)),
    )


BEND = Stage("bend", FREE, gravity=False, fixed=("left",), moves=(Move("right", (0.0, 0.0, 6.0)),))


def test_two_parts_tied_node_by_node_are_one() -> None:
    whole = box_mesh((30.0, 20.0, 10.0), (6, 4, 2))
    x = whole.nodes[:, 0]
    one = _solved(box_model(whole, SOFT, left=np.flatnonzero(x == 0.0), right=np.flatnonzero(x == 30.0)), BEND)
    two = _solved(replace(_tied((3, 4, 2)), ties=("face",)), BEND)
    assert one.status is two.status is Status.CONVERGED, two.message
    moved = PointMap(one.mesh, one.displacement).forward(two.mesh.nodes)
    np.testing.assert_allclose(two.mesh.nodes + two.displacement, moved, atol=1e-5)


def test_parts_of_other_meshes_are_tied() -> None:
    """Onto a part cut otherwise: tied nodes lie in its faces, and it bends as the whole does."""
    one, other = (_solved(replace(_tied(counts), ties=("face",)), BEND) for counts in ((3, 4, 2), (4, 5, 3)))
    assert one.status is other.status is Status.CONVERGED, other.message
    points = np.random.default_rng(0).uniform([1.0, 1.0, 1.0], [29.0, 19.0, 9.0], (200, 3))
    places = [PointMap(answer.mesh, answer.displacement).forward(points) for answer in (one, other)]
    assert np.linalg.norm(places[1] - places[0], axis=1).max() < 0.05
    face = _tied((4, 5, 3)).node_set("face")
    beside = PointMap(TetMesh(other.mesh.nodes, other.mesh.tetrahedra[_beyond(other.mesh)]), other.displacement)
    tied = other.mesh.nodes[face]
    np.testing.assert_allclose(beside.forward(tied), tied + other.displacement[face], atol=1e-5)


def _beyond(mesh: TetMesh) -> np.ndarray:
    return np.flatnonzero(mesh.nodes[mesh.corners].mean(axis=1)[:, 0] > 15.0)


def test_ties_to_nothing_are_refused() -> None:
    model = replace(_tied((3, 4, 2)), ties=("right",))
    with pytest.raises(BadInput, match="mm away from the part"):
        _solved(model, BEND)


def _stacked(gap_mm: float) -> Model:
    """Two blocks of one mesh, one above the other, with a gap between them."""
    lower, upper = box_mesh((20.0, 20.0, 10.0), (3, 3, 2)), box_mesh((20.0, 20.0, 10.0), (4, 4, 2))
    nodes = np.vstack([lower.nodes, upper.nodes + [0.0, 0.0, 10.0 + gap_mm]])
    mesh = TetMesh(nodes, np.vstack([lower.tetrahedra, upper.tetrahedra + len(lower.nodes)]))
    z = nodes[:, 2]
    low, high = np.flatnonzero(z == 0.0), np.flatnonzero(z == z.max())
    return box_model(mesh, Material("linear-elastic", 10.0, 0.0), low=low, high=high)


@pytest.mark.parametrize("element", ["T4", "T10"])
def test_an_organ_that_folds_onto_itself_pushes_back(element: str) -> None:
    """Two blocks pressed together shorten alike; without self-contact they pass through each other."""
    press = Stage("press", FREE, gravity=False, fixed=("low",), moves=(Move("high", (0.0, 0.0, -2.0)),))
    scenario = Scenario((), (press,), rest_shape="as-scanned")
    solver = QuasiStatic(QuasiStaticParameters(element=element, self_contact=True))
    answer = solver.solve(_stacked(0.6), scenario)
    assert answer.status is Status.CONVERGED, answer.message
    mesh = answer.mesh
    moved = mesh.nodes + answer.displacement
    z = mesh.nodes[:, 2]
    gap = moved[z == 10.6, 2].mean() - moved[z == 10.0, 2].mean()
    assert 0.0 < gap < 0.12
    assert moved[z > 10.0, 2].min() > moved[z <= 10.0, 2].max()
    # Each block is shortened by half of what the gap leaves of the way, its middle by a half of that.
    shortened = 0.5 * (2.0 - 0.6 + gap)
    assert answer.displacement[z == 5.0, 2].mean() == pytest.approx(-0.5 * shortened, rel=0.02)
    plain = QuasiStatic(QuasiStaticParameters(element=element)).solve(_stacked(0.6), scenario)
    np.testing.assert_allclose(plain.displacement[plain.mesh.nodes[:, 2] <= 10.0], 0.0, atol=1e-9)


def test_self_contact_is_the_derivative_of_its_energy() -> None:
    model = _stacked(0.05)
    mesh = model.mesh.as_quadratic()
    part = SelfContact(mesh, 0.1, 10.0)
    rng = np.random.default_rng(0)
    positions = mesh.nodes + rng.uniform(-0.005, 0.005, mesh.nodes.shape)
    direction = rng.uniform(-1.0, 1.0, mesh.nodes.shape)
    groups, local = part.stiffness(positions, project=False)
    change = np.zeros_like(positions)
    np.add.at(change, groups, np.einsum("kabij,kbj->kai", local, direction[groups]))
    assert np.abs(part.forces(positions)).max() > 0.1

    def energy_rest(h: float) -> float:
        there = part.energy(positions + h * direction) - part.energy(positions)
        return abs(there + h * float(np.vdot(part.forces(positions), direction)))

    def force_rest(h: float) -> float:
        return float(np.abs(part.forces(positions + h * direction) - part.forces(positions) + h * change).max())

    for rest in (energy_rest, force_rest):
        assert np.log(rest(1e-5) / rest(1e-6)) / np.log(10.0) == pytest.approx(2.0, abs=0.1)


def test_a_surface_that_cuts_itself_is_refused() -> None:
    with pytest.raises(BadInput, match="cuts itself in the scanned shape"):
        SelfContact(_stacked(-1.0).mesh, 0.1, 10.0)
