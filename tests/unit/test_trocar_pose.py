"""Poses from corners: against SciPy's least squares and drawn noise, with false corners, moved crosses, two minima."""

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

import trocar_views
from glisson.core.camera import Camera
from glisson.core.crosses import Cross, CrossLayout
from glisson.core.localisation import Localisation
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.codes import cross_codes
from glisson.intraoperative.trocar.corners import corners_at
from glisson.intraoperative.trocar.global_localiser import GlobalLocaliser
from glisson.intraoperative.trocar.localiser import LocaliserParameters
from glisson.intraoperative.trocar.pose import pose_from_corners
from glisson.phantom.optics import seen_at
from trocar_views import CAMERA

SIGMA_PX = 0.08


def drawn(layout, room_from_trocar, rng, sigma_px=SIGMA_PX, camera=CAMERA):
    places = np.concatenate([cross.corners_mm for cross in layout.crosses])
    pixels = seen_at(camera, room_from_trocar.inverse().apply(places))
    return pixels + rng.normal(size=pixels.shape) * sigma_px


def as_seen(layout, pixels, camera=CAMERA):
    count = len(layout)
    return corners_at(camera, layout, np.repeat(np.arange(count), 12), np.tile(np.arange(12), count), pixels, SIGMA_PX)


def error(found, true):
    step = found.camera_from_room.inverse()
    turned = Rotation.from_matrix(step.rotation @ true.rotation.T).as_rotvec()
    return np.concatenate([turned, step.translation_mm - true.translation_mm]), step.covariance


def test_the_minimum_is_scipys():
    layout, true = trocar_views.layout(), trocar_views.pose(1)
    pixels = drawn(layout, true, np.random.default_rng(1))
    found = pose_from_corners(as_seen(layout, pixels), CAMERA, layout)
    places = np.concatenate([cross.corners_mm for cross in layout.crosses])
    pinhole = Camera(CAMERA.width, CAMERA.height, CAMERA.focal_px, CAMERA.centre_px)
    flat = as_seen(layout, pixels).slopes * CAMERA.focal_px + CAMERA.centre_px

    def rest(x):
        in_camera = (places - x[3:]) @ Rotation.from_rotvec(x[:3]).as_matrix()
        return (seen_at(pinhole, in_camera) - flat).ravel()

    start = np.concatenate([Rotation.from_matrix(true.rotation).as_rotvec(), true.translation_mm])
    other = least_squares(rest, start, x_scale=[0.01] * 3 + [10.0] * 3, xtol=1e-15, ftol=1e-15)
    back = found.camera_from_room.inverse()
    assert np.allclose(back.translation_mm, other.x[3:], atol=1e-4)
    assert np.allclose(back.rotation, Rotation.from_rotvec(other.x[:3]).as_matrix(), atol=1e-7)


def test_errors_are_as_predicted():
    layout, rng = trocar_views.layout(), np.random.default_rng(2)
    squares = []
    for n in range(400):
        true = trocar_views.pose(n)
        found = pose_from_corners(as_seen(layout, drawn(layout, true, rng)), CAMERA, layout)
        off, covariance = error(found, true)
        squares.append(off @ np.linalg.solve(covariance, off))
    # 90 % of the errors in 90 % ellipsoids, but for three standard deviations of a share of 400.
    assert np.mean(np.array(squares) < chi2.ppf(0.9, 6)) == pytest.approx(0.9, abs=0.045)


def test_errors_of_places_and_calibration_are_as_predicted():
    true_layout, rng = trocar_views.layout(), np.random.default_rng(3)
    place = np.array([1e-3] * 3 + [0.6] * 3)
    lens = np.array([0.3, 0.3, 0.4, 0.4, 1e-3, 0.0, 0.0, 0.0, 0.0])
    squares = []
    for n in range(400):
        true = trocar_views.pose(n)
        crosses = []
        for cross in true_layout.crosses:
            step, pose = rng.normal(size=6) * place, cross.room_from_cross
            turned = Rotation.from_rotvec(step[:3]).as_matrix() @ pose.rotation
            moved = RigidTransform("room", "cross", turned, pose.translation_mm + step[3:], np.diag(place**2))
            crosses.append(Cross(cross.name, cross.colours, cross.size_mm, moved))
        step = rng.normal(size=9) * lens
        camera = Camera(
            640, 480, CAMERA.focal_px + step[:2], CAMERA.centre_px + step[2:4], CAMERA.distortion + step[4:],
            np.diag(lens**2),
        )  # fmt: skip
        layout = CrossLayout(tuple(crosses))
        found = pose_from_corners(as_seen(layout, drawn(true_layout, true, rng), camera), camera, layout)
        off, covariance = error(found, true)
        squares.append(off @ np.linalg.solve(covariance, off))
    assert np.mean(np.array(squares) < chi2.ppf(0.9, 6)) == pytest.approx(0.9, abs=0.045)


def test_false_corners_and_a_moved_cross_are_left_out():
    layout, rng = trocar_views.layout(), np.random.default_rng(4)
    for n in range(30):
        true = trocar_views.pose(n)
        pixels = drawn(layout, true, rng)
        false = rng.choice(48, 6, replace=False)
        pixels[false] += rng.uniform(3.0, 30.0, (6, 1)) * [1.0, -1.0]
        pixels[48:] += [25.0, 10.0]
        found = pose_from_corners(as_seen(layout, pixels), CAMERA, layout)
        assert not found.agree[false].any()
        assert not found.agree[48:].any()
        off, covariance = error(found, true)
        assert off @ np.linalg.solve(covariance, off) < chi2.ppf(0.9999, 6)


def test_two_crosses_that_contradict_each_other_give_no_pose():
    layout = trocar_views.layout(2)
    pixels = drawn(layout, trocar_views.pose(5), np.random.default_rng(5))
    pixels[12:] += [40.0, -10.0]
    assert pose_from_corners(as_seen(layout, pixels), CAMERA, layout) is None


def judged(layout, pixels, camera=CAMERA) -> Localisation:
    seen = as_seen(layout, pixels, camera)
    found = pose_from_corners(seen, camera, layout)
    return GlobalLocaliser(LocaliserParameters()).judged(found, seen, camera, layout)


def test_the_second_minimum_of_a_plane_is_told():
    # Two small crosses near each other, far away and slanted: with weak perspective the plane's tilt has two signs.
    turned = Rotation.from_euler("x", 0.5).as_matrix()
    crosses = [
        Cross(f"{n}", cross_codes()[n], 60.0, RigidTransform("room", "cross", turned, [100.0 * n, 0.0, 2900.0]))
        for n in range(2)
    ]
    layout = CrossLayout(tuple(crosses))
    true = RigidTransform("room", "trocar", np.eye(3), [0.0, 0.0, 1000.0])
    told = judged(layout, drawn(layout, true, np.random.default_rng(6)))
    assert told.status is Status.AMBIGUOUS
    poses = [told.room_from_trocar, told.second]
    # One of the two is near the truth, the other one is not.
    tilts = sorted(Rotation.from_matrix(one.rotation.T @ true.rotation).magnitude() for one in poses)
    assert tilts[0] < 0.25
    assert tilts[1] > 0.5


def test_wide_bounds_are_told():
    layout = trocar_views.layout(2, size_mm=80.0)
    true = RigidTransform("room", "trocar", np.eye(3), [0.0, 0.0, 1000.0])
    told = judged(layout, drawn(layout, true, np.random.default_rng(7)))
    assert told.status is Status.UNOBSERVABLE
    assert told.position_bound_mm > 5.0
