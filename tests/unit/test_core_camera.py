"""Transforms with covariance, and projection against its formula written out."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from glisson.core import BadInput
from glisson.core.camera import Camera
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import directions, project, project_with_jacobian, undistorted

CAMERA = Camera(1440, 1080, [1100.0, 1105.0], [715.0, 548.0], [-0.21, 0.07, 1e-3, -8e-4, -0.01])


def pose(rng, target="camera", source="room", *, spread=0.02):
    root = rng.normal(size=(6, 6)) * spread
    turn = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
    return RigidTransform(target, source, turn, rng.normal(size=3) * 20.0, root @ root.T * np.outer(SCALE, SCALE))


SCALE = np.array([0.05, 0.05, 0.05, 1.0, 1.0, 1.0])


def drawn(transform, rng):
    step = rng.multivariate_normal(np.zeros(6), transform.covariance)
    turn = Rotation.from_rotvec(step[:3]).as_matrix() @ transform.rotation
    return RigidTransform(transform.target, transform.source, turn, transform.translation_mm + step[3:])


def spread_about(middle, transforms):
    steps = [
        np.concatenate([
            Rotation.from_matrix(one.rotation @ middle.rotation.T).as_rotvec(),
            one.translation_mm - middle.translation_mm,
        ])
        for one in transforms
    ]  # fmt: skip
    return np.cov(np.array(steps).T)


def assert_alike(found, sampled):
    """Equal but for what 20,000 draws leave open, in units of the standard deviations."""
    scale = np.sqrt(np.diag(sampled))
    assert np.abs((found - sampled) / np.outer(scale, scale)).max() < 0.05


@pytest.mark.parametrize(
    ("row", "column", "value", "sentence"),
    [(0, 0, -1.0, "negative variance"), (0, 1, 0.5, "symmetric"), (5, 5, 0.0, None), (4, 4, 1e-12, None)],
)
def test_a_covariance_must_be_one(row, column, value, sentence):
    def pose_of(spread):
        return RigidTransform("room", "camera", np.eye(3), np.zeros(3), spread)

    for size, made in ((6, pose_of), (9, lambda spread: Camera(640, 480, [5e2] * 2, [3e2] * 2, np.zeros(5), spread))):
        spread = np.eye(size)
        spread[row, column] = value
        if sentence is None:
            np.testing.assert_array_equal(made(spread).covariance, spread)
            continue
        with pytest.raises(BadInput, match=sentence):
            made(spread)
        spread = np.eye(size)
        spread[:3, :3] = [[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]]
        with pytest.raises(BadInput, match="semi-definite"):
            made(spread)


def test_covariance_of_an_inverse_and_of_a_product_as_drawn():
    rng = np.random.default_rng(4)
    a, b = pose(rng, "camera", "room"), pose(rng, "room", "patient")
    pairs = [(drawn(a, rng), drawn(b, rng)) for _ in range(20_000)]
    assert_alike(a.inverse().covariance, spread_about(a.inverse(), [one.inverse() for one, _ in pairs]))
    assert_alike(a.after(b).covariance, spread_about(a.after(b), [one.after(two) for one, two in pairs]))
    point = np.array([30.0, -10.0, 5.0])
    assert_alike(b.point_covariance(point), np.cov(np.array([two.apply(point) for _, two in pairs]).T))


def test_inverse_and_product_are_what_they_say():
    rng = np.random.default_rng(5)
    a, b = pose(rng, "camera", "room"), pose(rng, "room", "patient")
    points = rng.normal(size=(7, 3))
    assert np.allclose(a.inverse().apply(a.apply(points)), points, atol=1e-12)
    assert np.allclose(a.after(b).apply(points), a.apply(b.apply(points)), atol=1e-12)
    assert (a.after(b).target, a.after(b).source) == ("camera", "patient")
    with pytest.raises(BadInput, match="cannot follow"):
        b.after(a)


def written_out(camera, transform, points):
    """Brown's distortion, term by term."""
    k1, k2, p1, p2, k3 = camera.distortion
    pixels = []
    for x, y, z in transform.apply(points):
        x, y = x / z, y / z
        rr = x * x + y * y
        radial = 1.0 + k1 * rr + k2 * rr**2 + k3 * rr**3
        u = x * radial + 2.0 * p1 * x * y + p2 * (rr + 2.0 * x * x)
        v = y * radial + p1 * (rr + 2.0 * y * y) + 2.0 * p2 * x * y
        pixels.append(camera.focal_px * [u, v] + camera.centre_px)
    return np.array(pixels)


def seen(rng, count=50):
    transform = RigidTransform("camera", "room", Rotation.from_rotvec(rng.normal(size=3)).as_matrix(), [1.0, 2.0, 3.0])
    in_camera = np.column_stack([rng.uniform(-0.5, 0.5, (count, 2)), np.ones(count)]) * rng.uniform(50, 200, (count, 1))
    return transform, transform.inverse().apply(in_camera)


def test_projection_and_its_inverse():
    transform, points = seen(np.random.default_rng(6))
    pixels = project(CAMERA, transform, points)
    assert np.allclose(pixels, written_out(CAMERA, transform, points), atol=1e-9)
    in_camera = transform.apply(points)
    assert np.allclose(undistorted(CAMERA, pixels), in_camera[:, :2] / in_camera[:, 2:], atol=1e-9)
    unit = in_camera / np.linalg.norm(in_camera, axis=1, keepdims=True)
    assert np.allclose(directions(CAMERA, pixels), unit, atol=1e-9)


def test_derivative_of_a_projection_by_taylor():
    rng = np.random.default_rng(7)
    transform, points = seen(rng)
    pixels, jacobian = project_with_jacobian(CAMERA, transform, points)
    way = rng.normal(size=15) * [0.1, 0.1, 0.1, 5, 5, 5, 20, 20, 20, 20, 0.1, 0.1, 0.01, 0.01, 0.1]
    rests = []
    for size in (1e-2, 1e-3):
        step = size * way
        turn = Rotation.from_rotvec(step[:3]).as_matrix() @ transform.rotation
        moved = RigidTransform("camera", "room", turn, transform.translation_mm + step[3:6])
        camera = Camera(
            1440, 1080, CAMERA.focal_px + step[6:8], CAMERA.centre_px + step[8:10], CAMERA.distortion + step[10:]
        )
        rests.append(np.linalg.norm(project(camera, moved, points) - pixels - jacobian @ step))
    assert np.log10(rests[0] / rests[1]) == pytest.approx(2.0, abs=0.1)
