from math import cos, radians, sin, tan

import numpy as np
import pytest
from bodies import body_of, box_mesh, box_model, floor, solve

from glisson.core import Board, ContactLaw, Lever, Material, Scenario, Stage, Status
from glisson.mechanics.contact_law import Cushion, shear_share, shear_slope, slip_energy
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.tools import LeverTool

BLOCK = Material("neo-hookean", 50.0, 0.3, 1150.0)
SIZES = (40.0, 30.0, 20.0)
WEIGHT_N = 1150e-9 * 40 * 30 * 20 * 9806.65 * 1e-3  # 0.2707 N


@pytest.mark.parametrize("hardening", [0.0, 64.0])
def test_the_pressure_is_the_slope_of_the_cushion_energy(hardening: float) -> None:
    cushion = Cushion(0.1, 2000.0, hardening)
    gaps = np.linspace(-0.05, 0.12, 200)
    h = 1e-6
    numeric = -(cushion.energy(gaps + h) - cushion.energy(gaps - h)) / (2 * h)
    np.testing.assert_allclose(cushion.pressure(gaps), numeric, atol=1e-6)
    slope = -(cushion.pressure(gaps + h) - cushion.pressure(gaps - h)) / (2 * h)
    np.testing.assert_allclose(cushion.slope(gaps), slope, rtol=1e-4, atol=1e-3)
    pressures = np.array([0.0, 1e-3, 0.1, 1.0, 50.0])
    np.testing.assert_allclose(cushion.pressure(cushion.gap(pressures)), pressures, rtol=1e-12, atol=1e-12)


def test_the_shear_is_the_slope_of_the_slip_energy() -> None:
    slips, h = np.linspace(1e-4, 0.06, 100), 1e-7
    numeric = (slip_energy(slips + h, 0.02) - slip_energy(slips - h, 0.02)) / (2 * h)
    np.testing.assert_allclose(shear_share(slips, 0.02), numeric, rtol=1e-5, atol=1e-7)
    slope = (shear_share(slips + h, 0.02) - shear_share(slips - h, 0.02)) / (2 * h)
    np.testing.assert_allclose(shear_slope(slips, 0.02), slope, rtol=1e-4, atol=1e-3)


def test_distance_to_the_lever() -> None:
    """Against the rounded box by brute force: sampled points of the inner box, grown by the radius."""
    lever = Lever.lifting("lever", np.zeros(3), np.array([1.0, 0, 0]), np.array([0, -1.0, 0]), length_mm=60.0)
    tool = LeverTool(lever)
    rotation, _ = tool.pose(radians(20.0))
    np.testing.assert_allclose(rotation @ [1, 0, 0], [cos(radians(20)), -sin(radians(20)), 0], atol=1e-12)
    rng = np.random.default_rng(0)
    points = rng.uniform([-20, -20, -20], [80, 20, 20], (200, 3))
    distances, (normals, hessians) = tool.distance(points), tool.derivatives(points)
    half = np.array([60.0, 8.0, 25.0]) / 2 - 3.0
    nearest = np.clip(points - [30.0, -4.0, 0.0], -half, half) + [30.0, -4.0, 0.0]
    outside = np.linalg.norm(points - nearest, axis=1) > 1e-9
    brute = np.linalg.norm(points - nearest, axis=1) - 3.0
    np.testing.assert_allclose(distances[outside], brute[outside], atol=1e-12)
    h = 1e-6
    for axis in range(3):
        step = h * np.eye(3)[axis]
        change = tool.distance(points + step) - tool.distance(points - step)
        turn = tool.derivatives(points + step)[0] - tool.derivatives(points - step)[0]
        np.testing.assert_allclose(normals[:, axis], change / (2 * h), atol=1e-5)
        np.testing.assert_allclose(hessians[:, :, axis], turn / (2 * h), atol=1e-4)


def _pressed_and_sheared():
    """A block on a floor with friction anchors behind it: body, positions, touches and a direction to move in."""
    mesh = box_mesh(SIZES, (3, 3, 2))
    body = body_of(mesh, BLOCK, boards=[floor(0.05)], stick_mm=0.05)
    body.law = ContactLaw(0.3, 2.0)
    rng = np.random.default_rng(2)
    anchored = mesh.nodes + rng.uniform(-0.003, 0.003, mesh.nodes.shape)
    body.renew_cohesion(anchored)
    body.touches(anchored)
    positions = anchored + [0.02, 0.01, 0.0]
    return body, positions, body.touches(positions), rng.uniform(-1, 1, mesh.nodes.shape)


def _remainder(body, positions, start, blocks, direction, h: float, update_friction: bool) -> float:
    """What the linearised forces miss of the true ones after a step h."""
    moved = positions + h * direction
    ahead = body.balance(moved, body.touches(moved, update_friction)).unbalanced
    change = (body.matrix(blocks) @ direction.ravel()).reshape(direction.shape)
    return np.abs(ahead - start + h * change).max()


def test_contact_forces_and_stiffness_are_derivatives() -> None:
    """Taylor test, friction limits held."""
    body, positions, touches, direction = _pressed_and_sheared()
    start = body.balance(positions, touches).unbalanced
    blocks = body.stiffness(positions, touches, project=False)
    slope, energy = -float(np.vdot(start, direction)), body.energy(positions)
    rest = [_remainder(body, positions, start, blocks, direction, h, False) for h in (1e-4, 1e-5)]
    energy_rest = [abs(body.energy(positions + h * direction) - energy - h * slope) for h in (1e-4, 1e-5)]
    assert np.log10(rest[0] / rest[1]) == pytest.approx(2.0, abs=0.2)
    assert np.log10(energy_rest[0] / energy_rest[1]) == pytest.approx(2.0, abs=0.2)


def test_friction_that_follows_the_pressure_makes_the_derivative_exact() -> None:
    """Taylor test, friction limits renewed at the moved state."""
    body, positions, touches, direction = _pressed_and_sheared()
    start = body.balance(positions, touches).unbalanced
    blocks = body.stiffness(positions, touches, project=False)
    body.add_friction_by_pressure(positions, touches, blocks)
    rest = [_remainder(body, positions, start, blocks, direction, h, True) for h in (1e-4, 1e-5)]
    assert np.log10(rest[0] / rest[1]) == pytest.approx(2.0, abs=0.2)


def _incline(angle_deg: float, law: ContactLaw):
    """A block on a floor, gravity tilted by the angle towards +x; nothing else holds it."""
    mesh = box_mesh(SIZES, (4, 3, 2))
    gravity = np.array([sin(radians(angle_deg)), 0.0, -cos(radians(angle_deg))])
    board = Board("board", np.zeros(3), np.array([0.0, 0.0, 1.0]))
    scenario = Scenario((board,), (Stage("tilt", law, fixed=()),), surgery_gravity=gravity, rest_shape="as-scanned")
    return QuasiStatic(QuasiStaticParameters(element="T4")).solve(box_model(mesh, BLOCK), scenario)


def test_a_block_carries_its_weight_in_newtons() -> None:
    answer = _incline(0.0, ContactLaw(0.3))
    assert answer.status is Status.CONVERGED
    assert answer.stages[-1].contacts[0].force_n == pytest.approx((0.0, 0.0, WEIGHT_N), rel=1e-5, abs=1e-6)


def test_a_block_sticks_below_the_friction_angle() -> None:
    friction = 0.3
    answer = _incline(0.8 * np.degrees(np.arctan(friction)), ContactLaw(friction))
    assert answer.status is Status.CONVERGED
    report = answer.stages[-1].contacts[0]
    shear, normal = -report.force_n[0], report.force_n[2]
    assert shear / normal == pytest.approx(tan(0.8 * np.arctan(friction)), rel=1e-4)
    assert np.abs(answer.displacement[:, 0]).max() < 0.2


def test_a_block_above_the_friction_angle_is_singular_and_says_where_it_slides() -> None:
    friction = 0.3
    answer = _incline(1.3 * np.degrees(np.arctan(friction)), ContactLaw(friction))
    assert answer.status is Status.SINGULAR
    assert "not held against sliding" in answer.message
    assert "(+x)" in answer.message  # named only when the direction is within 18° of the axis


def test_cohesion_holds_a_block_on_a_steep_incline() -> None:
    """At 60° and µ = 0.3 only the cohesion (c A = 2.4 N against 0.23 N of weight) holds the block."""
    assert _incline(60.0, ContactLaw(0.3, 2.0)).status is Status.CONVERGED
    assert _incline(60.0, ContactLaw(0.3)).status is Status.SINGULAR


@pytest.mark.parametrize("cohesion_kpa", [0.0, 0.5, 10.0])
def test_a_pulled_block_reacts_with_friction_and_cohesion(cohesion_kpa: float) -> None:
    """Pulled along the floor until it slides everywhere, the floor reacts with µ N + c A."""
    material = Material("neo-hookean", 5000.0, 0.3, 1150.0)
    mesh = box_mesh(SIZES, (4, 3, 2))
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[:, 0] = True  # every node is pulled, so that the whole base slides at once
    body = body_of(mesh, material, fixed, boards=[floor(-0.05)])
    body.law = ContactLaw(0.3, cohesion_kpa)
    body.external = np.zeros_like(mesh.nodes)
    pressed = 12.0e3  # mN, 10 kPa on the base
    body.external[:, 2] = -pressed / len(mesh.nodes)
    end = solve(body, np.array(mesh.nodes))
    body.renew_cohesion(end.positions)
    for _ in range(5):
        end = solve(body, end.positions + [0.05, 0.0, 0.0])
        assert end.status is Status.CONVERGED
        for contact in body.contacts:
            contact.drag_anchors(body.surface.positions(end.positions))
        body.renew_cohesion(end.positions)
    force = body.balance(end.positions, body.touches(end.positions)).contact.sum(axis=0)
    area = 40.0 * 30.0
    assert force[2] == pytest.approx(pressed, rel=1e-6)
    assert -force[0] == pytest.approx(0.3 * pressed + cohesion_kpa * area, rel=0.01)


def test_a_held_block_does_not_creep() -> None:
    """Ten load steps on a slope without change move a held block by less than 0.01 mm."""
    mesh = box_mesh(SIZES, (4, 3, 2))
    gravity = np.array([sin(0.2), 0.0, -cos(0.2)])
    board = Board("board", np.zeros(3), np.array([0.0, 0.0, 1.0]))
    stages = tuple(Stage(f"hold {n}", ContactLaw(0.3), fixed=()) for n in range(11))
    scenario = Scenario((board,), stages, surgery_gravity=gravity, rest_shape="as-scanned")
    answer = QuasiStatic(QuasiStaticParameters(element="T4")).solve(box_model(mesh, BLOCK), scenario)
    assert answer.status is Status.CONVERGED
    drift = answer.stages[-1].displacement - answer.stages[0].displacement
    assert np.abs(drift).max() < 0.01
