import numpy as np
import pytest
from skimage.segmentation import chan_vese

from glisson.preoperative.contours.localized_contour import (
    LocalizedContourParameters,
    ball_rows,
    curvatures,
    evolve,
    local_forces,
    smoothed_heaviside,
)
from glisson.preoperative.contours.signed_distance import reinitialised, signed_distance_of_mask
from glisson.preoperative.imaging.diffusion import diffused
from preoperative_shapes import dice

ONE = np.ones(3)


def coordinates(*shape: int) -> list[np.ndarray]:
    return list(np.meshgrid(*[np.arange(n, dtype=float) for n in shape], indexing="ij"))


def energy(image, phi, outer, epsilon, radius, separation):
    """Σ_y outer(y) E_y, straight from the definition, with balls by distances."""
    scaled = np.clip(phi / epsilon, -1.0, 1.0)
    h = 0.5 * (1.0 - scaled - np.sin(np.pi * scaled) / np.pi)
    places = np.argwhere(np.ones(phi.shape, dtype=bool))
    total = 0.0
    for y in np.argwhere(outer > 0.0):
        ball = places[np.linalg.norm(places - y, axis=1) <= radius]
        values, inside = image[tuple(ball.T)], h[tuple(ball.T)]
        u = (inside * values).sum() / inside.sum()
        v = ((1.0 - inside) * values).sum() / (1.0 - inside).sum()
        local = -0.5 * (u - v) ** 2
        if not separation:
            local = (inside * (values - u) ** 2 + (1.0 - inside) * (values - v) ** 2).sum()
        total += outer[tuple(y)] * local
    return total


@pytest.mark.parametrize("separation", [False, True], ids=["uniform", "separation"])
@pytest.mark.parametrize("shape", [(1, 24, 22), (12, 13, 12)], ids=["2-D", "3-D"])
def test_taylor_of_the_local_energies(shape, separation):
    """The flow is minus the derivative of the energy, with the outer δ held: the rest falls as h²."""
    rng = np.random.default_rng(3)
    image = rng.normal(100.0, 20.0, shape).astype(np.float32)
    i, j, k = coordinates(*shape)
    centre = (np.array(shape) - 1.0) / 2.0
    distance = np.sqrt(((i - centre[0]) * (shape[0] > 1)) ** 2 + (j - centre[1]) ** 2 + (k - centre[2]) ** 2)
    phi = distance - (6.3 if shape[0] == 1 else 3.4)
    epsilon, radius = 1.5, 4.0
    inside, delta = smoothed_heaviside(phi, epsilon)
    points = np.argwhere(delta > 0.0)
    rows = ball_rows(radius, ONE, 2 if shape[0] == 1 else 3)
    forces, _, _ = local_forces(image, inside, delta, points, rows, separation)
    direction = rng.normal(size=shape)
    at = tuple(points.T)
    slope = -(delta[at] * forces * direction[at]).sum()
    here = energy(image.astype(float), phi, delta, epsilon, radius, separation)
    rests = [
        abs(energy(image.astype(float), phi + h * direction, delta, epsilon, radius, separation) - here - h * slope)
        for h in (4e-3, 2e-3, 1e-3)
    ]
    orders = np.log2(np.array(rests[:-1]) / rests[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_heaviside_is_one_inside_and_its_slope_is_delta():
    phi = np.linspace(-3.0, 3.0, 601).reshape(1, 1, -1)
    inside, delta = smoothed_heaviside(phi, 1.5)
    assert inside[0, 0, 0] == 1.0
    assert inside[0, 0, -1] == 0.0
    assert inside[0, 0, 300] == pytest.approx(0.5)
    np.testing.assert_allclose(-np.gradient(inside[0, 0], phi[0, 0]), delta[0, 0], atol=2e-4)


@pytest.mark.parametrize("kind", ["uniform", "separation"])
def test_noisy_disc(kind):
    x, y = coordinates(200, 190)
    disc = (x - 101.0) ** 2 + (y - 93.0) ** 2 < 60.0**2
    image = 100.0 * disc + np.random.default_rng(0).normal(0.0, 30.0, disc.shape)
    start = (x - 98.0) ** 2 + (y - 96.0) ** 2 < 54.0**2
    result = evolve(image, start, np.ones(2), LocalizedContourParameters(energy=kind, radius_mm=15.0))
    assert dice(result.mask, disc) >= 0.99
    assert 2.0 < result.moved_mm < 10.0


def test_pixels_need_not_be_square():
    x, y = coordinates(120, 200)
    disc = (1.5 * x - 90.0) ** 2 + (0.8 * y - 80.0) ** 2 < 50.0**2
    image = 100.0 * disc + np.random.default_rng(1).normal(0.0, 20.0, disc.shape)
    start = (1.5 * x - 90.0) ** 2 + (0.8 * y - 80.0) ** 2 < 45.0**2
    result = evolve(image, start, np.array([1.5, 0.8]), LocalizedContourParameters(radius_mm=15.0))
    assert dice(result.mask, disc) >= 0.99


def test_uneven_background_where_global_chan_vese_fails():
    x, y = coordinates(200, 190)
    disc = (x - 101.0) ** 2 + (y - 93.0) ** 2 < 60.0**2
    image = 60.0 * disc + 1.2 * x + np.random.default_rng(2).normal(0.0, 10.0, disc.shape)
    start = (x - 98.0) ** 2 + (y - 96.0) ** 2 < 54.0**2
    result = evolve(image, start, np.ones(2), LocalizedContourParameters(radius_mm=15.0))
    whole = chan_vese(image, mu=0.1, max_num_iter=200)
    assert dice(result.mask, disc) >= 0.98
    assert max(dice(whole, disc), dice(~whole, disc)) < 0.8


def test_noisy_ball_in_3d():
    i, j, k = coordinates(40, 42, 44)
    ball = (i - 20.0) ** 2 + (j - 20.0) ** 2 + (k - 21.0) ** 2 < 13.0**2
    image = 80.0 * ball + np.random.default_rng(0).normal(0.0, 20.0, ball.shape)
    start = (i - 19.0) ** 2 + (j - 21.0) ** 2 + (k - 21.0) ** 2 < 10.5**2
    result = evolve(image, start, ONE, LocalizedContourParameters(radius_mm=6.0, iterations=60))
    assert dice(result.mask, ball) >= 0.99


def test_a_contour_keeps_within_its_freedom_and_says_that_it_moved_on():
    x, y = coordinates(120, 120)
    disc = (x - 60.0) ** 2 + (y - 60.0) ** 2 < 40.0**2
    start = (x - 60.0) ** 2 + (y - 60.0) ** 2 < 32.0**2
    result = evolve(100.0 * disc, start, np.ones(2), LocalizedContourParameters(radius_mm=12.0), freedom_mm=3.0)
    reached = np.sqrt((x - 60.0) ** 2 + (y - 60.0) ** 2)[result.mask].max()
    assert 34.0 < reached < 36.0


def test_a_contour_at_the_border_of_the_disc_rests():
    x, y = coordinates(120, 120)
    disc = (x - 60.0) ** 2 + (y - 60.0) ** 2 < 40.0**2
    result = evolve(100.0 * disc, disc, np.ones(2), LocalizedContourParameters(radius_mm=12.0))
    assert result.converged
    assert result.iterations <= 40
    assert dice(result.mask, disc) > 0.995


def test_curvature_of_circle_and_sphere():
    i, j, k = coordinates(31, 31, 31)
    sphere = np.sqrt((i - 15.0) ** 2 + (j - 15.0) ** 2 + (k - 15.0) ** 2)
    points = np.argwhere(np.abs(sphere - 10.0) < 1.0)
    np.testing.assert_allclose(curvatures(sphere - 10.0, points, ONE), 2.0 / sphere[tuple(points.T)], rtol=0.02)
    circle = np.sqrt((j - 15.0) ** 2 + (k - 15.0) ** 2)[:1]
    points = np.argwhere(np.abs(circle - 10.0) < 1.0)
    np.testing.assert_allclose(curvatures(circle - 10.0, points, ONE), 1.0 / circle[tuple(points.T)], rtol=0.02)


def test_reinitialising_gives_distances_and_leaves_the_contour_where_it_is():
    spacing = np.array([1.0, 0.8, 1.3])
    j, k = coordinates(100, 80)
    exact = (np.hypot(0.8 * (j - 50.0), 1.3 * (k - 40.0)) - 28.0)[None]
    bent = exact * (3.0 + 0.05 * exact)
    found = reinitialised(bent, spacing)
    near = np.abs(exact) < 6.0
    assert np.abs(found - exact)[near].max() < 0.15
    for _ in range(20):
        found = reinitialised(found, spacing, 4.0)
    assert np.abs(found - exact)[np.abs(exact) < 1.0].max() < 0.15
    assert found.max() == 4.0


def test_signed_distance_of_a_mask_is_half_a_voxel_at_its_border():
    mask = np.zeros((1, 9), dtype=bool)
    mask[0, 3:6] = True
    np.testing.assert_allclose(
        signed_distance_of_mask(mask, np.array([1.0, 1.0]))[0], [2.5, 1.5, 0.5, -0.5, -1.5, -0.5, 0.5, 1.5, 2.5]
    )


def test_diffusion_smooths_noise_keeps_edges_and_the_mean():
    rng = np.random.default_rng(0)
    step = np.where(np.arange(60)[:, None, None] < 30, 100.0, -80.0) + rng.normal(0.0, 6.0, (60, 40, 20))
    smooth = diffused(step, np.array([1.0, 1.0, 2.0]), 20.0, 6)
    assert smooth.mean() == pytest.approx(step.mean(), abs=1e-2)
    assert smooth[5:25].std() < 0.5 * step[5:25].std()
    assert smooth[29].mean() - smooth[30].mean() > 0.9 * 180.0
    assert smooth.min() >= step.min() - 1e-3
    assert smooth.max() <= step.max() + 1e-3
