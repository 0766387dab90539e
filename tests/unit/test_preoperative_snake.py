"""Snakes against the flow of a circle, exact slopes, and borders whose place is known."""

import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.preoperative.contours.outline_spline import spread_evenly
from glisson.preoperative.contours.snake import SnakeParameters, run_snake
from glisson.preoperative.contours.snake_energy import SnakeEnergy, SnakeWeights

SPACING = np.array([0.8, 0.7])


def circle(centre, radius, count=60):
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return np.asarray(centre) + radius * np.stack([np.sin(angles), np.cos(angles)], axis=1)


def disk(centre, radius, shape=(110, 120), inside=120.0, outside=60.0):
    """A disk whose border pixels have the grey value of their share."""
    rows, columns = np.indices(shape)
    away = radius - np.hypot(rows * SPACING[0] - centre[0], columns * SPACING[1] - centre[1])
    return outside + (inside - outside) * np.clip(away / SPACING.mean() + 0.5, 0.0, 1.0)


@pytest.mark.parametrize(("tension", "stiffness"), [(0.5, 0.0), (0.0, 40.0)])
def test_without_an_image_a_circle_shrinks_as_it_must(tension, stiffness):
    """Along its length v'' = −v/r² and v'''' = v/r⁴: dr/dt = −α/r − β/r³; both have a closed form."""
    nothing = SnakeEnergy(np.zeros((100, 100)), SPACING, SnakeWeights())
    steps, step, radius = 200, 0.5, 20.0
    parameters = SnakeParameters(tension, stiffness, step, iterations=steps, tolerance_mm=1e-6)
    found = run_snake(nothing, circle((40.0, 40.0), radius), parameters)
    time = steps * step
    expected = np.sqrt(radius**2 - 2.0 * tension * time) if tension else (radius**4 - 4.0 * stiffness * time) ** 0.25
    radii = np.linalg.norm(found.points_mm - 40.0, axis=1)
    assert not found.converged
    np.testing.assert_allclose(radii, expected, rtol=3e-3)


def test_the_force_is_the_slope_of_the_energy():
    rng = np.random.default_rng(1)
    weights = SnakeWeights(line=0.3, edge=1.0, termination=0.5, noise=1e-6)
    energy = SnakeEnergy(rng.normal(0.0, 50.0, (40, 50)), SPACING, weights)
    points, across = rng.uniform(5.0, 25.0, (30, 2)), rng.normal(size=(30, 2))
    errors = []
    for step in (1e-2, 5e-3, 2.5e-3):
        change = energy.at(points + step * across) - energy.at(points)
        errors.append(np.abs(change + step * np.einsum("na,na->n", energy.force(points), across)).mean())
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, 2.0, atol=0.1)


@pytest.mark.parametrize("start", [17.5, 22.5])
def test_it_settles_on_a_border_from_both_sides(start):
    centre, radius = (42.0, 40.0), 20.0
    energy = SnakeEnergy(disk(centre, radius), SPACING, SnakeWeights())
    found = run_snake(energy, circle(centre, start), SnakeParameters())
    assert found.converged
    radii = np.linalg.norm(found.points_mm - centre, axis=1)
    np.testing.assert_allclose(radii, radius, atol=0.2)
    assert found.moved_mm == pytest.approx(abs(start - radius), abs=0.2)


def test_a_line_and_an_open_snake_whose_ends_stay():
    rows, _ = np.indices((100, 110))
    places = rows * SPACING[0]
    dark = 100.0 - 80.0 * np.exp(-(((places - 40.0) / 2.0) ** 2))
    energy = SnakeEnergy(dark, SPACING, SnakeWeights(line=1.0, edge=0.0))
    drawn = np.array([[40.0, 5.0], [44.0, 30.0], [36.0, 50.0], [40.0, 70.0]])
    found = run_snake(energy, drawn, SnakeParameters(), closed=False)
    np.testing.assert_allclose(found.points_mm[[0, -1]], drawn[[0, -1]], atol=1e-9)
    np.testing.assert_allclose(found.points_mm[:, 0], 40.0, atol=0.1)


def test_termination_is_what_level_lines_bend_by_and_knows_no_unit_of_grey_values():
    """Level lines of a cone are circles: their curvature is 1/r."""
    rows, columns = np.indices((120, 120))
    away = np.hypot(rows * SPACING[0] - 48.0, columns * SPACING[1] - 42.0)
    points = circle((48.0, 42.0), 20.0)
    weights = SnakeWeights(edge=0.0, termination=1.0, sigma_mm=3.0, noise=1e-9)
    found = [SnakeEnergy(scale * away, SPACING, weights).at(points) for scale in (10.0, 1000.0)]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)
    np.testing.assert_allclose(np.abs(found[0]), 3.0 / 20.0, rtol=0.02)


def test_too_few_points_are_told_and_double_clicks_forgiven():
    energy = SnakeEnergy(np.zeros((20, 20)), SPACING, SnakeWeights())
    with pytest.raises(BadInput, match="closed contour needs more points"):
        run_snake(energy, np.zeros((2, 2)), SnakeParameters())
    drawn = circle((8.0, 8.0), 5.0)
    np.testing.assert_allclose(spread_evenly(np.repeat(drawn, 2, axis=0), 1.0, True), spread_evenly(drawn, 1.0, True))
