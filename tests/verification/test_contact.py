from math import cos, radians, sin

import numpy as np
import pytest

from glisson.core import ContactLaw, Lever, Status
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.lever_tool import LeverTool
from glisson.verification.friction import incline

WEIGHT_N = 1150e-9 * 40 * 30 * 10 * 9806.65 * 1e-3  # 0.1353 N, of the block of `incline`


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


def test_a_block_carries_its_weight_in_newtons() -> None:
    answer = incline(0.0, ContactLaw(0.3))
    assert answer.status is Status.CONVERGED
    assert answer.stages[-1].contacts[0].force_n == pytest.approx((0.0, 0.0, WEIGHT_N), rel=1e-5, abs=1e-6)


def test_a_block_above_the_friction_angle_is_singular_and_says_where_it_slides() -> None:
    friction = 0.3
    answer = incline(1.3 * np.degrees(np.arctan(friction)), ContactLaw(friction))
    assert answer.status is Status.SINGULAR
    assert "not held against sliding" in answer.message
    assert "(+x)" in answer.message  # named only when the direction is within 18° of the axis
