"""Technique "forces" against the full model, a finer mesh, differences, and what must be refused."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import block

from glisson.core import BadInput
from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.observations import Observation, Observations
from glisson.core.registry import make_technique
from glisson.core.status import Status
from glisson.geometry.distance import SurfaceTree
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.registration.forces import Forces, ForcesParameters, PreparedForces
from glisson.mechanics.registration.pulled_body import Pulled, PulledBody
from glisson.mechanics.registration.pulled_body_building import pulled_body
from glisson.mechanics.registration.smooth_forces import smooth_forces
from glisson.studies.registration.pulled_liver import _with_middles

SIZE = (80.0, 24.0, 24.0)
MATERIAL = Material("neo-hookean-log", 6.0, 0.4)


def bar(cells: tuple[int, int, int] = (10, 4, 4), quadratic: bool = False) -> Model:
    """A bar held at x = 0, pulled at its far end, of which the upper side is seen."""
    mesh = block(cells, SIZE)
    mesh = mesh.as_quadratic() if quadratic else mesh
    x, _, z = mesh.nodes.T
    sets = {
        "held": np.flatnonzero(x < 1e-9),
        "far": np.flatnonzero(x > SIZE[0] - 1e-9),
        "upper": np.flatnonzero(z > SIZE[2] - 1e-9),
    }
    return Model(mesh, {0: MATERIAL}, {0: "bar"}, sets)


def even_pull(mesh: TetMesh, nodes: np.ndarray, force: FloatArray) -> Load:
    """An even traction on the far end that sums to a force in mN, by areas."""
    triangles = mesh.boundary()[0]
    triangles = triangles[np.isin(triangles, nodes).all(axis=1)]
    shares = np.bincount(triangles.ravel(), minlength=len(mesh.nodes))[nodes]  # all triangles are alike
    return Load(nodes=nodes, forces=np.outer(shares / shares.sum(), force))


def cloud(mesh: TetMesh, positions: FloatArray, upper: np.ndarray, seed: int, sigma: float = 0.0) -> Observations:
    """400 points of the upper side."""
    rng = np.random.default_rng(seed)
    triangles = mesh.boundary()[0]
    triangles = triangles[np.isin(triangles, upper).all(axis=1)]
    chosen = triangles[rng.integers(len(triangles), size=400)]
    points = np.einsum("pa,pai->pi", rng.dirichlet(np.ones(3), 400), positions[chosen])
    points += sigma * rng.normal(size=points.shape)
    return Observations((Observation("surface", "upper", points, max(sigma, 0.05)),))


@pytest.fixture(scope="module")
def model() -> Model:
    return bar()


@pytest.fixture(scope="module")
def prepared(model: Model) -> PreparedForces:
    exact = {"model_error_mm": 0.02, "model_error_length_mm": 1.0}
    return Forces(ForcesParameters("held", "far", reach_mm=20.0, patch_mm=200.0, loads=40, **exact)).prepare(model)


@pytest.fixture(scope="module")
def body(model: Model) -> PulledBody:
    far = model.node_set("far")
    return pulled_body(FullModel(model, ("held",)), far, smooth_forces(model.mesh, far, 24.0, 20), 20.0, 8)


def test_smooth_forces_are_the_traction_of_a_random_field(model: Model) -> None:
    """All fields together have the covariance they were asked for; one of endless length is an even traction."""
    far = model.node_set("far")
    even = smooth_forces(model.mesh, far, 1e5, 20)
    loads = even_pull(model.mesh, far, np.array([1.0, 0.0, 0.0])).forces[:, 0]
    assert even.shape == (len(far), 1)
    np.testing.assert_allclose(even[:, 0] / even.sum(), loads, atol=1e-9)
    places = model.mesh.nodes[far]
    fields = smooth_forces(model.mesh, far, 6.0, 1000)
    apart = ((places[:, None] - places[None]) ** 2).sum(axis=2)
    wanted = loads[:, None] * np.exp(-0.5 * apart / 36.0) * loads
    found = fields @ fields.T
    np.testing.assert_allclose(found / np.trace(found), wanted / np.trace(wanted), atol=3e-4)


def test_the_compliance_is_the_derivative_of_the_equilibrium(body: PulledBody) -> None:
    """Taylor: what the compliance leaves of a further step of the forces is of second order."""
    rng = np.random.default_rng(2)
    here = body.moved(body.at_rest, rng.normal(size=body.count) * 0.5)
    here = body.state(here.amounts, here.modal)
    step, follows = rng.normal(size=body.count), body.follows(here)
    left = []
    for size in (0.04, 0.02):
        there = body.moved(here, size * step)
        left.append(float(np.linalg.norm(there.modal - here.modal - size * follows @ step)))
    assert np.log2(left[0] / left[1]) == pytest.approx(2.0, abs=0.15)


def test_forces_of_a_full_solution_are_found(model: Model, prepared: PreparedForces) -> None:
    """By the full model that the reduced one was made from: bent by as much as it is thick."""
    full, far = FullModel(model, ("held",)), model.node_set("far")
    for force in ([0.0, 0.0, 50.0], [20.0, -50.0, 20.0]):
        true = np.array(force)
        there = full.solve(even_pull(model.mesh, far, true))
        assert np.linalg.norm(there - model.mesh.nodes, axis=1).max() > 15.0
        found = prepared.register(cloud(model.mesh, there, model.node_set("upper"), 3))
        assert found.status == Status.CONVERGED, found.deformation.message
        assert np.linalg.norm(found.positions_mm - there, axis=1).mean() < 0.2
        assert np.linalg.norm(found.forces_mn.sum(axis=0) - true) < 0.05 * np.linalg.norm(true)


def test_a_finer_truth_is_found(prepared: PreparedForces) -> None:
    """T10 makes the truth: positions still fit, and the force is off by as much as T4 is too stiff."""
    fine = bar((8, 4, 4), quadratic=True)
    coarse = bar((8, 4, 4))
    far, true = coarse.node_set("far"), np.array([0.0, 0.0, 8.0])
    pull = even_pull(coarse.mesh, far, true)
    there = FullModel(fine, ("held",)).solve(pull)
    seen = cloud(coarse.mesh, there[: len(coarse.mesh.nodes)], coarse.node_set("upper"), 4)
    found = prepared.register(seen)
    surface = SurfaceTree(found.positions_mm, bar().mesh.boundary()[0])
    corners = np.unique(coarse.mesh.boundary()[0])
    assert surface.nearest(there[corners]).distance_mm.mean() < 1.0
    stiff = bar()
    moved = FullModel(stiff, ("held",)).solve(even_pull(stiff.mesh, stiff.node_set("far"), true)) - stiff.mesh.nodes
    ratio = (there - fine.mesh.nodes)[far, 2].mean() / moved[stiff.node_set("far"), 2].mean()
    assert found.forces_mn.sum(axis=0)[2] / 8.0 == pytest.approx(ratio, rel=0.1)


def test_the_next_frame_begins_from_the_last(model: Model, prepared: PreparedForces) -> None:
    full, far = FullModel(model, ("held",)), model.node_set("far")
    loads = [even_pull(model.mesh, far, np.array([0.0, 0.0, size])) for size in (40.0, 46.0)]
    seen = [cloud(model.mesh, full.solve(load), model.node_set("upper"), 5) for load in loads]
    last = prepared.register(seen[0])
    on, anew = prepared.register(seen[1], last), prepared.register(seen[1])
    np.testing.assert_allclose(on.positions_mm, anew.positions_mm, atol=0.2)


def test_the_spread_is_that_of_noise(model: Model) -> None:
    """Answers to clouds of other noise scatter as the posterior says, within what 24 of them can tell."""
    chosen = ForcesParameters(held="held", pulled="far", reach_mm=20.0, loads=12, model_error_mm=0.001)
    prepared = Forces(chosen).prepare(model)
    there = FullModel(model, ("held",)).solve(even_pull(model.mesh, model.node_set("far"), np.array([0.0, 0.0, 30.0])))
    found = [prepared.register(cloud(model.mesh, there, model.node_set("upper"), seed, 1.0)) for seed in range(24)]
    tip = model.node_set("far")
    scatter = np.array([one.positions_mm[tip] for one in found]).std(axis=0, ddof=1)
    told = np.sqrt((found[0].spread_mm[tip] ** 2).sum(axis=2))
    assert 0.6 < float(np.sqrt((scatter**2).mean() / (told**2).mean())) < 1.4


def test_what_cannot_be_is_refused(model: Model, prepared: PreparedForces) -> None:
    seen = cloud(model.mesh, model.mesh.nodes, model.node_set("upper"), 6)
    with pytest.raises(BadInput, match="no node set 'back'"):
        make_technique("registration", "forces", {}, "register").prepare(model)
    with pytest.raises(BadInput, match="no node set 'nowhere'"):
        Forces(ForcesParameters(held="held", pulled="nowhere")).prepare(model)
    with pytest.raises(BadInput, match="are held"):
        Forces(ForcesParameters(held="held", pulled="held")).prepare(model)
    with pytest.raises(BadInput, match='frame "patient"'):
        prepared.register(Observations((replace(seen.items[0], frame="room"),)))
    with pytest.raises(BadInput, match="no triangle"):
        Forces(ForcesParameters(held="upper", pulled="held")).prepare(
            replace(model, node_sets={**model.node_sets, "held": model.node_set("held")[:1]})
        )


def test_another_organ_is_told(model: Model, prepared: PreparedForces) -> None:
    wide = model.mesh.nodes * [1.0, 1.0, 1.5]
    found = prepared.register(cloud(model.mesh, wide, model.node_set("upper"), 9))
    assert found.status == Status.AMBIGUOUS
    assert "Is it of this organ?" in found.deformation.message


def test_an_answer_without_forces_is_no_beginning_but_no_hindrance(model: Model, prepared: PreparedForces) -> None:
    seen = cloud(model.mesh, model.mesh.nodes, model.node_set("upper"), 6)
    found = prepared.register(seen)
    again = prepared.register(seen, replace(found, forces_mn=None))
    np.testing.assert_allclose(again.positions_mm, found.positions_mm, atol=1e-6)


def test_nothing_pulled_is_found_at_rest(model: Model, prepared: PreparedForces) -> None:
    found = prepared.register(cloud(model.mesh, model.mesh.nodes, model.node_set("upper"), 7))
    assert np.linalg.norm(found.positions_mm - model.mesh.nodes, axis=1).max() < 0.05


def test_middles_of_quadratic_elements_belong_to_the_set_of_both_ends() -> None:
    fine = bar((4, 2, 2), quadratic=True)
    corners = bar((4, 2, 2)).node_set("held")
    np.testing.assert_array_equal(_with_middles(fine.mesh, corners), fine.node_set("held"))


def test_a_state_is_found_again_from_its_positions(body: PulledBody) -> None:
    moved: Pulled = body.moved(body.at_rest, np.full(body.count, 0.3))
    again = body.nearest(body.positions(moved), body.forces(moved))
    np.testing.assert_allclose(again.amounts, moved.amounts, atol=1e-9)
    np.testing.assert_allclose(again.modal, moved.modal, atol=1e-4)
