"""The wire's centreline against closed-form curves: from two projections, from tracked tips, from a scan."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.structures import Curve
from glisson.core.transform import RigidTransform
from glisson.intraoperative.wire.fluoroscopy import Projection, curve_from_projections
from glisson.intraoperative.wire.smooth_curve import smooth_curve
from glisson.intraoperative.wire.sources import curve_from_scan, curve_from_tips
from glisson.phantom.optics import seen_at

CAMERA = Camera(1024, 1024, np.array([3000.0, 3000.0]), np.array([512.0, 512.0]))
_T = np.linspace(0.0, 1.0, 400)


def helix(t=_T, radius=25.0, rise=80.0, turns=0.9):
    angle = 2.0 * np.pi * turns * t
    return np.column_stack([radius * np.cos(angle), rise * (t - 0.5), radius * np.sin(angle)])


def source(angle_deg, distance=700.0, axis="y"):
    """An X-ray source that looks at the origin after a turn about an axis."""
    turn = Rotation.from_euler(axis, angle_deg, degrees=True).as_matrix()
    return RigidTransform("room", "camera", turn, turn @ [0.0, 0.0, -distance])


def seen(angle_deg, points, rng, sigma=0.3, axis="y"):
    pose = source(angle_deg, axis=axis)
    pixels = seen_at(CAMERA, (points - pose.translation_mm) @ pose.rotation)
    return Projection(CAMERA, pose, pixels + sigma * rng.standard_normal(pixels.shape), sigma)


def off_curve(points, dense):
    steps = np.linalg.norm(points[:, None, :] - dense[None], axis=2)
    return dense[steps.argmin(axis=1)] - points


@pytest.mark.parametrize("angle", [30.0, 60.0, 90.0])
def test_a_helix_from_two_projections(angle):
    rng = np.random.default_rng(int(angle))
    truth = helix()
    found = curve_from_projections(seen(0.0, truth, rng), seen(angle, truth, rng))
    assert (found.kind, found.frame) == ("curve", "room")
    off = np.linalg.norm(off_curve(found.points_mm, helix(np.linspace(0.0, 1.0, 20_000))), axis=1)
    assert np.median(off) < 0.3
    assert np.percentile(off, 95) < 1.0
    length = np.linalg.norm(np.diff(found.points_mm, axis=0), axis=1).sum()
    exact = np.hypot(2.0 * np.pi * 0.9 * 25.0, 80.0)
    assert length == pytest.approx(exact, rel=0.03)


def test_error_bars_across_the_wire_hold():
    dense, inside = helix(np.linspace(0.0, 1.0, 20_000)), []
    for seed in range(40):
        rng = np.random.default_rng([3, seed])
        found = curve_from_projections(seen(0.0, helix(), rng), seen(70.0, helix(), rng))
        off = off_curve(found.points_mm, dense)
        tangents = np.gradient(found.points_mm, axis=0)
        for at in range(5, len(off) - 5, 12):
            # Across the tangent only: along the wire its points may slide.
            across = np.linalg.svd(tangents[at][None])[2][1:]
            spread = across @ found.covariance_mm2[at] @ across.T
            part = across @ off[at]
            inside.append(part @ np.linalg.solve(spread, part) < 4.605)
    assert np.mean(inside) > 0.85


def test_projections_that_tell_nothing_are_refused():
    rng, truth = np.random.default_rng(1), helix()
    with pytest.raises(StageFailed, match="turn the C-arm farther") as close:
        curve_from_projections(seen(0.0, truth, rng), seen(2.0, truth, rng))
    assert close.value.status is Status.UNOBSERVABLE
    flat = np.column_stack([np.linspace(-40.0, 40.0, 100), np.zeros(100), 5.0 * np.sin(np.linspace(0, 3, 100))])
    with pytest.raises(StageFailed, match="along the epipolar lines") as along:
        curve_from_projections(seen(0.0, flat, rng, 0.01), seen(60.0, flat, rng, 0.01))
    assert along.value.status is Status.UNOBSERVABLE
    with pytest.raises(StageFailed, match="do not fit each other"):
        curve_from_projections(seen(0.0, truth, rng), seen(60.0, truth + [0.0, 60.0, 0.0], rng))


def test_a_tracked_tip_is_smoothed_to_the_helix():
    rng = np.random.default_rng(5)
    times, sigma = np.linspace(0.0, 20.0, 600), 0.8
    tips = helix(times / 20.0) + sigma * rng.standard_normal((600, 3))
    found = curve_from_tips(times, tips, np.tile(sigma**2 * np.eye(3), (600, 1, 1)), spacing_mm=15.0)
    off = np.linalg.norm(off_curve(found.points_mm, helix(np.linspace(0.0, 1.0, 20_000))), axis=1)
    assert np.median(off) < 0.3
    assert found.time_s == 20.0
    with pytest.raises(BadInput, match="moved by"):
        curve_from_tips(times, tips * 1e-3, np.tile(np.eye(3), (600, 1, 1)))
    jumped = tips.copy()
    jumped[300:310] += 30.0
    with pytest.raises(StageFailed, match="farther from a smooth curve"):
        curve_from_tips(times, jumped, np.tile(sigma**2 * np.eye(3), (600, 1, 1)), spacing_mm=15.0)


def test_covariance_of_a_smoothed_straight_line_is_that_of_least_squares():
    """Of a spline of one piece: the hat matrix of a cubic polynomial, whose bending the prior hardly holds."""
    share, sigma = np.linspace(0.0, 1.0, 80), 0.1
    points = np.column_stack([100.0 * share, np.zeros(80), np.zeros(80)])
    found = smooth_curve(share, points, np.tile(sigma**2 * np.eye(3), (80, 1, 1)), 1e3)
    design = np.vander(share, 4)
    at = np.vander(np.array([0.5]), 4)
    expected = sigma**2 * at @ np.linalg.inv(design.T @ design) @ at.T
    middle = len(found.points_mm) // 2
    assert found.covariance_mm2[middle, 1, 1] == pytest.approx(expected[0, 0], rel=0.01)


def test_a_scans_centreline_is_passed_on():
    found = curve_from_scan(Curve(helix()), 0.4)
    assert (found.kind, found.name, found.frame, found.sigma_mm) == ("curve", "wire", "patient", 0.4)
    np.testing.assert_array_equal(found.points_mm, helix())
