"""The reduced model against the full one, closed forms, and SciPy's least squares."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import block, rotation
from scipy.optimize import nnls

from glisson.core import BadInput, Model
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.tools import Cylinder
from glisson.io.array_files import read_arrays, write_arrays
from glisson.mechanics.cylinder import CylinderTool
from glisson.mechanics.reduced.basis import modes
from glisson.mechanics.reduced.building import Sizes, build_reduced
from glisson.mechanics.reduced.contact import ReducedContact, reduced_surface
from glisson.mechanics.reduced.cubature import choose_points
from glisson.mechanics.reduced.estimate import ErrorEstimate
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.live import LiveModel, Update
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.local import Pulled, local_compliance
from glisson.mechanics.reduced.model import ReducedModel
from glisson.mechanics.reduced.packing import KIND, SCHEMA, pack, unpack
from glisson.mechanics.reduced.points import elastic_points
from glisson.mechanics.reduced.potential import ReducedPotential
from glisson.mechanics.reduced.training import from_reduced, from_rest, taken_on

MATERIAL = Material("neo-hookean-log", 6.0, 0.45, 1150.0)


def bar_model(cells=(8, 3, 3), nodes_from=lambda nodes: nodes) -> Model:
    """A bar of 80 × 24 × 24 mm that is held at x = 0."""
    mesh = block(cells, (80.0, 24.0, 24.0))
    held = np.flatnonzero(mesh.nodes[:, 0] < 1e-9)
    far = np.flatnonzero(mesh.nodes[:, 0] > 80.0 - 1e-9)
    moved = TetMesh(nodes_from(mesh.nodes), mesh.tetrahedra)
    return Model(moved, {0: MATERIAL}, {0: "bar"}, {"held": held, "far": far})


def drawn(full: FullModel, number: int, pull_mn: float = 12.0) -> Load:
    """Pulls at the far end; every other load has a round bar that presses from above."""
    random = np.random.default_rng((5, number))
    far = full.model.node_set("far")
    forces = np.tile(random.normal(size=3) * pull_mn / len(far), (len(far), 1))
    weight = random.normal(size=3) * 0.02
    if number % 2 == 0:
        return Load(weight, far, forces)
    depth = random.uniform(2.0, 6.0)
    end = np.array([random.uniform(50.0, 70.0), 12.0, 24.0 - depth + 10.0])
    tool = CylinderTool(Cylinder("bar", end, end + [0.0, 0.0, 40.0], 10.0))
    return Load(weight, far, forces, tool, np.array([0.0, 0.0, -depth - 2.0]))


def reach_of(full: FullModel) -> np.ndarray:
    """Nodes on the surface's far half."""
    surface = np.unique(full.model.mesh.boundary()[0])
    return surface[
        np.linalg.norm(full.rest[surface] - full.rest[full.model.node_set("far")].mean(axis=0), axis=1) < 50.0
    ]


@pytest.fixture(scope="module")
def full() -> FullModel:
    return FullModel(bar_model(), ("held",))


@pytest.fixture(scope="module")
def reduced(full: FullModel) -> ReducedModel:
    displacements = from_rest(full, [drawn(full, number) for number in range(30)])
    model = build_reduced(full, displacements, reach_of(full), Sizes(16, 80, 32, 150, 1e-4))
    loads = [drawn(full, number) for number in range(100, 160)]
    numbers, truths = from_reduced(full, model, loads)
    raw, errors = judged(full, model, [loads[n] for n in numbers], truths)
    return replace(model, estimate=model.estimate.calibrated(raw, errors))


def judged(full, model, loads, truths):
    """Raw estimates and true errors (mm) of reduced answers."""
    raw, errors = [], []
    for load, truth in zip(loads, truths, strict=True):
        answer = model.solve(load, model.state(full.rest + truth))
        raw.append(model.raw_error_mm(load, answer))
        errors.append(np.linalg.norm(model.positions(answer) - full.rest - truth, axis=1).max())
    return np.array(raw), np.array(errors)


def brought_on(live: LiveModel, load: Load) -> Update:
    """The last update of a load that comes on in steps."""
    return [live.update(load.part(share)) for share in np.linspace(0.0, 1.0, 11)[1:]][-1]


def test_all_modes_and_all_points_give_the_full_answer() -> None:
    full = FullModel(bar_model((4, 2, 2)), ("held",))
    free = np.flatnonzero(~full.fixed.ravel())
    basis = np.zeros((full.fixed.size, len(free)))
    basis[free, np.arange(len(free))] = 1.0
    basis = basis.reshape(*full.fixed.shape, len(free))
    points = elastic_points(full.model.mesh, full.model.materials, basis)
    surface = reduced_surface(full.model.mesh, full.surface, basis, reach_of(full))
    local = local_compliance(full, reach_of(full), basis)
    assert np.abs(local.fields).max() < 1e-5  # nothing is left for it
    estimate = ErrorEstimate(points, np.eye(len(free)), basis[:1])
    weights = np.tensordot(full.weights, basis, 2)
    model = ReducedModel(full.rest, basis, points, surface, local, weights, full.cushion, estimate)
    load = drawn(full, 1)
    answer = taken_on(model, load)
    moved = np.abs(full.solve(load) - full.rest).max()
    assert moved > 3.0
    assert np.abs(model.positions(answer) - full.solve(load)).max() < 1e-4 * moved


def test_with_its_local_compliance_any_mode_answers_as_the_full_linear_model(full: FullModel) -> None:
    # A faint pull on one node: the mode has nothing of it but for its own share.
    basis = modes(from_rest(full, [drawn(full, 0)]), 1)
    node = int(reach_of(full)[7])
    load = Load(np.zeros(3), np.array([node]), np.array([[0.001, 0.002, -0.001]]))
    points = elastic_points(full.model.mesh, full.model.materials, basis)
    surface = reduced_surface(full.model.mesh, full.surface, basis, reach_of(full))
    local = local_compliance(full, reach_of(full), basis)
    weights = np.tensordot(full.weights, basis, 2)
    estimate = ErrorEstimate(points, np.eye(1), basis[:1])
    model = ReducedModel(full.rest, basis, points, surface, local, weights, full.cushion, estimate)
    truth = full.solve(load) - full.rest
    assert np.abs(model.positions(model.solve(load)) - full.rest - truth).max() < 1e-3 * np.abs(truth).max()


def test_pulls_by_patterns_move_what_their_forces_move_one_by_one(reduced: ReducedModel) -> None:
    local, random = reduced.local, np.random.default_rng(4)
    turn = rotation(np.array([1.0, 2.0, 0.5]), 0.7)
    shares = np.zeros((len(local.nodes), 2))
    shares[3:9, 0], shares[5:14, 1] = random.uniform(size=6), random.uniform(size=9)
    pulled = Pulled.of(local, shares @ random.normal(size=(2, 3)))
    again = shares @ random.normal(size=(2, 3))
    same = pulled.by(again)
    alone = np.einsum("kin...,ki->n...", local.fields, again @ turn) @ turn.T
    assert np.abs(same.displacement(turn) - alone).max() < 1e-5 * np.abs(alone).max()
    assert pulled.by(random.normal(size=again.shape)) is None


def test_forces_and_stiffness_are_derivatives_of_the_energy(full: FullModel, reduced: ReducedModel) -> None:
    load = drawn(full, 1)
    start = reduced.solve(load.part(0.9))
    pulled = Pulled.of(reduced.local, reduced.local.on_nodes(load.nodes, load.forces))
    contact = ReducedContact(
        reduced.surface.in_modes(reduced.size), reduced.local, load, reduced.cushion, start.state.modal, pulled
    )
    random = np.random.default_rng(1)
    unknowns = np.concatenate([start.state.modal, random.uniform(0.5, 2.0, len(contact.pushed))])
    assert len(contact.pushed) > 0
    assert contact.energy(unknowns) > 0.0
    potential = ReducedPotential(reduced.points, reduced.dead_forces(load)[: reduced.size], contact)
    across = random.normal(size=len(unknowns))
    remainders = []
    for step in (1e-2, 5e-3):
        ahead, behind = unknowns + step * across, unknowns - step * across
        slope = (potential.energy(ahead) - potential.energy(behind)) / (2.0 * step)
        change = (potential.gradient(ahead) - potential.gradient(behind)) / (2.0 * step)
        remainders.append(
            (
                abs(slope - potential.gradient(unknowns) @ across),
                np.linalg.norm(change - potential.stiffness(unknowns) @ across),
            )
        )
    orders = np.log2(np.array(remainders[0]) / np.array(remainders[1]))
    assert (orders > 1.8).all()


def test_modes_of_known_fields() -> None:
    fields, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(60, 3)))
    amounts = np.random.default_rng(1).normal(size=(10, 3)) * [10.0, 3.0, 1.0]
    found = modes((amounts @ fields.T).reshape(10, 20, 3), 8)
    assert found.shape == (20, 3, 3)
    flat = found.reshape(60, 3)
    assert np.allclose(flat @ flat.T, fields @ fields.T, atol=1e-9)


def test_points_are_those_of_least_squares_without_negative_factors() -> None:
    random = np.random.default_rng(3)
    contributions = random.normal(size=(40, 120)) + 0.5
    chosen = choose_points(contributions, 1e-6, 200)
    assert chosen.factors.min() > 0.0
    _, left = nnls(contributions, contributions.sum(axis=1))
    reached = np.linalg.norm(contributions[:, chosen.points] @ chosen.factors - contributions.sum(axis=1))
    assert left < 1e-6
    assert reached <= 1e-6 * np.linalg.norm(contributions.sum(axis=1))
    assert len(chosen.points) <= 40


def test_few_points_give_nearly_the_full_answer_and_the_bound_holds(full: FullModel, reduced: ReducedModel) -> None:
    assert len(reduced.points.weights) <= 88 < len(full.model.mesh.tetrahedra)
    loads = [drawn(full, number) for number in range(200, 240)]
    numbers, truths = from_reduced(full, reduced, loads)
    assert len(numbers) == len(loads)
    raw, errors = judged(full, reduced, loads, truths)
    moved = np.linalg.norm(truths, axis=2).max(axis=1)
    assert np.median(moved) > 5.0
    assert np.median(errors) < 0.02 * np.median(moved)
    bounds = np.array([reduced.estimate.bound_mm(value) for value in raw])
    assert (bounds >= errors).all()


def test_truths_near_reduced_answers_are_those_on_the_way_from_rest(full: FullModel, reduced: ReducedModel) -> None:
    for number in (201, 202):
        load = drawn(full, number)
        _, near = from_reduced(full, reduced, [load])
        assert np.abs(full.path(load)[-1] - full.rest - near[0]).max() < 1e-3


def test_a_load_unlike_all_others_falls_back_to_the_full_model(full: FullModel, reduced: ReducedModel) -> None:
    live = LiveModel(reduced, full, largest_mm=1.0)
    usual = brought_on(live, drawn(full, 300))
    assert not usual.fell_back
    assert usual.bound_mm <= 1.0
    far = full.model.node_set("far")
    strong = Load(np.zeros(3), far, np.tile([0.0, 4.0, 0.0], (len(far), 1)))  # five times what was learned
    middle = np.flatnonzero(np.abs(full.rest[:, 0] - 20.0) < 1e-6)
    elsewhere = Load(np.zeros(3), middle, 2.0 * (full.rest[middle] - full.rest[middle].mean(axis=0)))
    for load in (strong, elsewhere):
        update = live.update(load)
        assert update.fell_back
        assert np.abs(update.positions - full.path(load)[-1]).max() < 1e-3
        live.reset()
    assert brought_on(live, drawn(full, 300)).bound_mm <= 1.0


def test_what_a_full_answer_has_shown_to_be_wrong_stays_known(full: FullModel, reduced: ReducedModel) -> None:
    load = drawn(full, 301)  # with a bar
    alone, shown = LiveModel(reduced, full, largest_mm=1e9), LiveModel(reduced, full, largest_mm=1e9)
    for share in np.linspace(0.1, 0.8, 8):
        alone.update(load.part(share))
        last = shown.update(load.part(share))
    shown._largest_mm = last.raw_mm
    assert shown.update(load.part(0.85)).fell_back
    alone.update(load.part(0.85))
    part = load.part(0.9)
    answers = [alone.update(part), shown.update(part)]
    assert not answers[1].fell_back
    errors = [np.linalg.norm(full.solve(part) - answer.positions, axis=1).max() for answer in answers]
    assert errors[1] < 0.5 * errors[0]
    assert errors[1] <= answers[1].bound_mm < answers[0].bound_mm


def test_a_tool_where_no_compliance_is_known_is_seen_by_the_estimate(full: FullModel, reduced: ReducedModel) -> None:
    end = np.array([20.0, 12.0, 30.0])  # over the held half
    tool = CylinderTool(Cylinder("bar", end, end + [0.0, 0.0, 40.0], 10.0))
    update = LiveModel(reduced, full, largest_mm=1.0).update(Load(tool=tool, approach=np.array([0.0, 0.0, -10.0])))
    assert update.fell_back


def test_a_world_that_is_turned_turns_the_answer(full: FullModel, reduced: ReducedModel) -> None:
    turn, shift = rotation(np.array([1.0, 2.0, 0.5]), 1.1), np.array([30.0, -20.0, 5.0])
    other = FullModel(bar_model(nodes_from=lambda nodes: nodes @ turn.T + shift), ("held",))

    def turned(load: Load) -> Load:
        tool = load.tool
        if isinstance(tool, CylinderTool):
            end = load.tool.pose(0.0)[1]  # the frame of a tool that did not move
            ends = [tool._start + end, tool._start + tool._line + end]
            tool = CylinderTool(Cylinder("bar", *(turn @ place + shift for place in ends), 10.0))
        return Load(turn @ load.weight, load.nodes, load.forces @ turn.T, tool, turn @ load.approach)

    trained = from_rest(other, [turned(drawn(full, number)) for number in range(30)])
    model = build_reduced(other, trained, reach_of(full), Sizes(16, 80, 32, 150, 1e-4))
    for number in (400, 401):
        load = drawn(full, number)
        here = reduced.positions(taken_on(reduced, load))
        there = model.positions(taken_on(model, turned(load)))
        assert np.abs(there - (here @ turn.T + shift)).max() < 0.02


def test_a_reduced_model_is_written_and_read(full: FullModel, reduced: ReducedModel, tmp_path) -> None:
    path = tmp_path / "reduced.npz"
    write_arrays(path, KIND, SCHEMA, pack(reduced))
    read = unpack(read_arrays(path, KIND, SCHEMA))
    load = drawn(full, 1)
    answer, again = reduced.solve(load), read.solve(load)
    assert np.array_equal(again.unknowns, answer.unknowns)
    assert np.array_equal(read.positions(again), reduced.positions(answer))
    assert read.raw_error_mm(load, again) == reduced.raw_error_mm(load, answer)
    assert read.estimate.factor == reduced.estimate.factor
    with pytest.raises(BadInput, match="newer"):
        read_arrays(path, KIND, SCHEMA - 1)
    with pytest.raises(BadInput, match="no template"):
        read_arrays(path, "template", SCHEMA)
    path.write_bytes(path.read_bytes()[:1000])
    with pytest.raises(BadInput, match="damaged"):
        read_arrays(path, KIND, SCHEMA)


def test_a_load_with_too_few_forces_is_refused() -> None:
    with pytest.raises(BadInput, match="2 loaded nodes"):
        Load(np.zeros(3), np.array([1, 2]), np.zeros((1, 3)))
