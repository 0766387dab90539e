import numpy as np
import pytest
from scipy.special import ellipeinc, ellipkinc

from glisson.phantom.implicit import cone, difference, ellipsoid, grown, half_space, intersection, moved_inside, union


def _volume_by_voxels(solid, step=0.25):
    low, high = solid.bounds[0] - 1.0, solid.bounds[1] + 1.0
    axes = [np.arange(low[a], high[a], step) + step / 2.0 for a in range(3)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    return float((solid.distance(points) < 0.0).sum()) * step**3


def _surface_area_of_ellipsoid(a, b, c):
    phi = np.arccos(c / a)
    k2 = a * a * (b * b - c * c) / (b * b * (a * a - c * c))
    return 2 * np.pi * c * c + 2 * np.pi * a * b / np.sin(phi) * (
        ellipeinc(phi, k2) * np.sin(phi) ** 2 + ellipkinc(phi, k2) * np.cos(phi) ** 2
    )


def test_volumes_agree_with_closed_forms():
    assert _volume_by_voxels(ellipsoid([1, 2, 3], [12, 9, 7])) == pytest.approx(4 / 3 * np.pi * 12 * 9 * 7, rel=2e-3)
    capsule = np.pi * 5**2 * 20 + 4 / 3 * np.pi * 5**3
    assert _volume_by_voxels(cone([0, 0, 0], [0, 12, 16], 5.0, 5.0)) == pytest.approx(capsule, rel=2e-3)
    half_ball = intersection(ellipsoid([0, 0, 0], [10, 10, 10]), half_space(1, 0.0, keep_below=True))
    assert _volume_by_voxels(half_ball) == pytest.approx(2 / 3 * np.pi * 1000, rel=2e-3)
    assert half_ball.bounds[1, 1] == 0.0


def test_value_is_a_distance_near_the_surface():
    # The shell between the levels ±h has volume 2 h × area where the value is the distance.
    solid, h = ellipsoid([0, 0, 0], [16, 12, 9]), 0.5
    shell = _volume_by_voxels(difference(grown(solid, h), grown(solid, -h)))
    assert shell == pytest.approx(2 * h * _surface_area_of_ellipsoid(16, 12, 9), rel=0.02)


def test_turned_ellipsoid_stays_in_its_box():
    angle = 0.6
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    solid = ellipsoid([0, 0, 0], [20, 5, 8], turn)
    assert _volume_by_voxels(solid) == pytest.approx(4 / 3 * np.pi * 20 * 5 * 8, rel=3e-3)


def test_blend_only_adds_and_keeps_far_away():
    first, second = ellipsoid([0, 0, 0], [10, 10, 10]), ellipsoid([15, 0, 0], [10, 10, 10])
    points = np.random.default_rng(0).uniform(-20, 35, size=(2000, 3))
    sharp, smooth = union([first, second]).distance(points), union([first, second], 6.0).distance(points)
    assert np.all(smooth <= sharp + 1e-12)
    assert np.all(smooth >= sharp - 1.5 - 1e-12)


def test_moved_inside_reaches_the_depth():
    solid = ellipsoid([0, 0, 0], [30, 20, 10])
    place = moved_inside(solid, [29.0, 5.0, 1.0], 4.0)
    assert float(solid.distance(place[None])[0]) <= -4.0 + 1e-5
