"""The free body under tractions: balanced forces, its second order against the full model, and bad starts."""

from dataclasses import replace

import numpy as np
import pytest
from blocks import block
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.model import Material, Model
from glisson.core.observations import Observation, Observations
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.core.status import Status
from glisson.mechanics.registration.floating import FloatingBody, rigid_motions
from glisson.mechanics.registration.second_order import SecondOrderMotion, second_derivatives
from glisson.mechanics.registration.tractions import TractionsParameters, likely_modes


@pytest.fixture(scope="module")
def model() -> Model:
    mesh = block((8, 4, 3), (120.0, 60.0, 40.0))
    return Model(mesh, {0: Material("neo-hookean-log", 5.0, 0.45)}, {0: "liver"}, {})


@pytest.fixture(scope="module")
def modes(model: Model) -> FloatArray:
    return likely_modes(model, FloatingBody(model), TractionsParameters())


def test_a_stretched_bar_is_hookes(model: Model) -> None:
    """Uniform tension on both ends of a free bar: u = F x / (E A), and − ν across; the six rigid motions absent."""
    tension = 0.01  # kPa
    nodes, body = model.mesh.nodes, FloatingBody(model)
    forces = np.zeros_like(nodes)
    triangles, _ = model.mesh.boundary()
    for end, sign in ((nodes[:, 0].min(), -1.0), (nodes[:, 0].max(), 1.0)):
        at_end = triangles[(nodes[triangles, 0] == end).all(axis=1)]
        corners = nodes[at_end]
        areas = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        np.add.at(forces[:, 0], at_end, sign * tension * areas[:, None] / 3.0)
    strain = tension / 5.0
    wanted = (nodes - nodes.mean(axis=0)) * strain * [1.0, -0.45, -0.45]
    assert body.response(forces) == pytest.approx(wanted, abs=1e-6 * strain * 120.0)


def test_a_push_at_one_side_is_balanced_by_the_mass(model: Model) -> None:
    """Its displacement has neither mean motion nor rotation, and does not change with a uniform weight added."""
    body, nodes = FloatingBody(model), model.mesh.nodes
    push = np.zeros_like(nodes)
    push[nodes[:, 2] == nodes[:, 2].max(), 2] = -1.0
    weight = np.zeros(len(nodes))
    np.add.at(weight, model.mesh.corners, model.mesh.corner_volumes_mm3[:, None] / 4.0)
    moved = body.response(push)
    assert np.abs(rigid_motions(nodes).T @ moved.ravel()).max() < 1e-9 * np.abs(moved).max() * moved.size
    heavier = body.response(push + 0.01 * weight[:, None] * [0.3, 1.0, -0.2])
    assert heavier == pytest.approx(moved, abs=1e-8 * np.abs(moved).max())


def test_the_second_order_is_that_of_the_full_model(model: Model, modes: FloatArray) -> None:
    """With it, forces in the deformed body are the loads' up to an error of third order; without it, of second."""
    body = FloatingBody(model)
    nodes, basis = model.mesh.nodes, modes[:, :, :3]
    motion = SecondOrderMotion(nodes, basis, np.eye(3), second_derivatives(body, basis))
    rigid, amounts = rigid_motions(nodes), np.array([1.0, -0.7, 0.5])

    def unbalanced(positions: FloatArray, size: float) -> float:
        step = 1e-4
        linear = (body.elasticity.forces(nodes + step * (basis @ amounts))) / step
        left = (body.elasticity.forces(positions) - size * linear).ravel()
        # What is left along rigid motions the turned dead loads take up.
        return float(np.linalg.norm(left - rigid @ (rigid.T @ left)))

    sizes = (0.2, 0.1)
    bent = [unbalanced(motion.shape(size * amounts), size) for size in sizes]
    straight = [unbalanced(nodes + size * (basis @ amounts), size) for size in sizes]
    assert np.log2(bent[0] / bent[1]) == pytest.approx(3.0, abs=0.3)
    assert np.log2(straight[0] / straight[1]) == pytest.approx(2.0, abs=0.3)


def test_its_derivative_is_that_of_differences_and_nearest_finds_back(model: Model, modes: FloatArray) -> None:
    rng = np.random.default_rng(1)
    second = second_derivatives(FloatingBody(model), modes[:, :, :6])
    motion = SecondOrderMotion(model.mesh.nodes, modes, np.eye(modes.shape[2]), second)
    state = motion.moved(motion.at_rest(), 0.3 * rng.normal(size=motion.size))
    step, every = rng.normal(size=motion.size), np.arange(len(model.mesh.nodes))
    slope = motion.derivative(state, every) @ step
    errors = [
        np.abs(motion.positions(motion.moved(state, size * step)) - motion.positions(state) - size * slope).max()
        for size in (2e-3, 1e-3)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.1)
    there = motion.positions(state)
    found = motion.positions(motion.nearest(there))
    assert np.abs(found - there).max() < 0.05 * np.abs(there - model.mesh.nodes - state.shift_mm).max()


def test_likely_motions_are_as_far_as_is_said(model: Model, modes: FloatArray) -> None:
    """Draws of the forces move tissue by `motion_mm` in the root mean square."""
    rng = np.random.default_rng(2)
    drawn = modes @ rng.normal(size=(modes.shape[2], 4000))
    assert np.sqrt((drawn**2).sum(axis=1).mean()) == pytest.approx(9.0, rel=0.03)


def test_a_doubt_stays_as_long_as_nothing_new_is_seen(model: Model) -> None:
    """A bar's flat side may be its other side: the next frame, which shows the same, cannot settle that."""
    nodes = model.mesh.nodes
    top = nodes[nodes[:, 2] == nodes[:, 2].max()]
    prepared = make_technique("registration", "tractions", {}, "the test").prepare(model)
    observations = Observations((Observation("surface", "whole", top, 0.5, "room"),))
    first = prepared.register(observations)
    assert first.status is Status.AMBIGUOUS, first.deformation.message
    assert prepared.register(observations, first).status is Status.AMBIGUOUS


def test_a_bad_last_answer_does_not_change_what_is_found(model: Model) -> None:
    """Three starts up to 30 mm and 30 degrees off: all end at the same place."""
    rng = np.random.default_rng(3)
    nodes = model.mesh.nodes
    there = nodes + [0.0, 0.0, 1.0] * ((nodes[:, :1] - 60.0) / 60.0) ** 2 * 6.0 + [15.0, 4.0, -9.0]
    triangles, _ = model.mesh.boundary()
    seen = there[triangles].mean(axis=1)[there[triangles].mean(axis=1)[:, 1] > 20.0]
    points = seen + rng.normal(scale=0.5, size=seen.shape)
    prepared = make_technique("registration", "tractions", {}, "the test").prepare(model)
    observations = Observations((Observation("surface", "whole", points, 0.5, "room"),))
    first = prepared.register(observations)

    def thrown(found: Registered) -> Registered:
        middle = found.positions_mm.mean(axis=0)
        turn = Rotation.from_rotvec(np.radians(rng.uniform(10.0, 30.0)) * np.eye(3)[rng.integers(3)]).as_matrix()
        away = (found.positions_mm - middle) @ turn.T + middle + rng.uniform(-17.0, 17.0, size=3)
        stage = replace(found.deformation.stages[0], displacement=away - nodes)
        return replace(found, deformation=replace(found.deformation, stages=(stage,)))

    answers = [prepared.register(observations, thrown(first)).positions_mm for _ in range(3)]
    assert max(np.linalg.norm(answer - first.positions_mm, axis=1).max() for answer in answers) < 0.1
