"""Rendered laparoscope views: what is hit, where it is seen, and how it is measured."""

from itertools import pairwise

import cv2
import numpy as np
import pytest
import trimesh

from glisson.core.camera import Camera
from glisson.core.mesh import TriangleSurface
from glisson.geometry.distance import closest_points
from glisson.phantom.half_sphere_box import (
    CAMERA,
    LANDMARKS_MM,
    POSITIONS_DEG,
    RADIUS_MM,
    TOUCHED_MM,
    HalfSphereBox,
    on_sphere,
    pixels_of,
    scope_place,
    touching_tool,
)
from glisson.phantom.laparoscope_view import Place, Tool, picture_through
from glisson.phantom.liver_view import TriangleScene, liver_scene, places_about
from glisson.phantom.measured_views import TROCAR, breathed, measured_pose, measured_views
from glisson.phantom.photograph import Sensor
from glisson.phantom.texture import Mottle

SMALL = Camera(360, 270, np.array([1250.0, 1250.0]), np.array([178.0, 137.0]), np.array([-0.2, 0.05, 0.0, 0.0, 0.0]))
CLEAN = Sensor(blur_px=0.3, noise=0.0, shot_noise=0.0, fall_off=0.0)


def test_rays_hit_sphere_and_mat_where_they_are():
    box = HalfSphereBox()
    origin = np.array([10.0, -5.0, 140.0])
    targets = np.concatenate([on_sphere([(0, 0), (20, 10), (-25, 5)]), [[60.0, 0.0, 0.0], [-50.0, 30.0, 0.0]]])
    rays = targets - origin
    lengths = np.linalg.norm(rays, axis=1)
    far, normals = box.hits(origin, rays / lengths[:, None])
    np.testing.assert_allclose(far, lengths, atol=1e-9)
    np.testing.assert_allclose(normals[:3], targets[:3] / RADIUS_MM, atol=1e-9)
    np.testing.assert_allclose(normals[3:], [[0, 0, 1], [0, 0, 1]])
    assert np.isinf(box.hits(origin, np.array([[0.0, 0.0, 1.0]]))[0]).all()


def test_positions_are_turned_as_printed_and_see_all_as_opencv_projects_it():
    places = [scope_place(angle) for angle in POSITIONS_DEG]
    turns = [np.degrees(np.arccos(a.rotation[:, 2] @ b.rotation[:, 2])) for a, b in pairwise(places)]
    np.testing.assert_allclose(turns, [3.28, 4.86, 3.71], atol=1e-6)
    for place in places:
        assert np.linalg.det(place.rotation) == pytest.approx(1.0)
        expected, _ = cv2.projectPoints(
            LANDMARKS_MM, cv2.Rodrigues(place.rotation.T)[0], -place.rotation.T @ place.centre_mm,
            CAMERA.matrix, CAMERA.distortion,
        )  # fmt: skip
        found = pixels_of(place, LANDMARKS_MM)
        np.testing.assert_allclose(found, expected.reshape(-1, 2), atol=1e-8)
        assert (found > 0).all()
        assert (found < [CAMERA.width, CAMERA.height]).all()
        assert np.linalg.norm(pixels_of(place, TOUCHED_MM[None])[0] - CAMERA.centre_px) > 20.0


def test_lines_of_the_sphere_cross_where_the_landmarks_are_seen():
    place = scope_place(0.0)
    picture = picture_through(CAMERA, place, HalfSphereBox(), touching_tool(), np.random.default_rng(0), CLEAN, 0.0)
    grey = cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY).astype(float)
    for u, v in pixels_of(place, LANDMARKS_MM):
        about = grey[round(v) - 25 : round(v) + 26, round(u) - 25 : round(u) + 26]
        assert grey[round(v), round(u)] < 0.6 * np.median(about)


def test_a_tool_ends_at_its_tip():
    place = Place(np.eye(3), np.zeros(3))

    class Nothing:
        def hits(self, origin, rays):
            return np.full(len(rays), 200.0), np.tile([0.0, 0.0, -1.0], (len(rays), 1))

        def colours(self, points):
            return np.tile([0.5, 0.1, 0.1], (len(points), 1))

    tip = np.array([2.0, 1.0, 100.0])
    picture = picture_through(
        SMALL, place, Nothing(), Tool(tip, np.array([-1.0, 0.2, -0.1])), np.random.default_rng(0), CLEAN
    )
    steel = np.argwhere(picture[:, :, 2] > 0.75 * picture[:, :, 0].astype(float))
    (u, v) = cv2.projectPoints(tip[None], np.zeros(3), np.zeros(3), SMALL.matrix, SMALL.distortion)[0].ravel()
    last = steel[steel[:, 1].argmax()]
    assert np.abs(last - [v, u]).max() < 1.5
    assert steel[:, 1].min() == 0


def test_triangles_are_hit_where_a_sphere_is():
    ball = trimesh.creation.icosphere(5, 30.0)
    scene = TriangleScene(TriangleSurface(ball.vertices, ball.faces))
    rng = np.random.default_rng(2)
    origin = np.array([0.0, -100.0, 0.0])
    rays = np.array([0.0, 100.0, 0.0]) + rng.uniform(-20.0, 20.0, (200, 3)) * [1, 0, 1]
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    far, normals = scene.hits(origin, rays)
    along = rays @ -origin
    exact = along - np.sqrt(along**2 - (100.0**2 - 30.0**2))
    np.testing.assert_allclose(far, exact, atol=0.05)
    np.testing.assert_allclose(normals, (origin + far[:, None] * rays) / 30.0, atol=0.02)


def test_a_livers_pixels_show_points_of_its_triangles():
    scene = liver_scene(3)
    target = scene.surface.vertices.mean(axis=0)
    (place,) = places_about(target, 160.0, np.array([0.0]))
    assert place.rotation[:, 2] @ [0.0, 1.0, 0.0] == pytest.approx(1.0)
    slopes = np.random.default_rng(1).uniform(-0.2, 0.2, (300, 2))
    rays = np.column_stack([slopes, np.ones(300)])
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ place.rotation.T
    far, _ = scene.hits(place.centre_mm, rays)
    met = np.isfinite(far)
    assert met.sum() > 150
    points = place.centre_mm + far[met, None] * rays[met]
    off, _ = closest_points(points, scene.surface)
    assert off.max() < 1e-6


def test_measured_poses_scatter_as_their_covariance_says():
    place, rng = scope_place(5.0), np.random.default_rng(0)
    poses = [measured_pose(place, TROCAR, rng) for _ in range(20_000)]
    centres = np.array([pose.translation_mm for pose in poses]) - place.centre_mm
    np.testing.assert_allclose(np.cov(centres.T), poses[0].covariance[3:, 3:], atol=0.03)
    tilts = np.array([np.arccos(np.clip(pose.rotation[:, 2] @ place.rotation[:, 2], -1.0, 1.0)) for pose in poses])
    # The angle between the axes of two turns of 2° each about axes across it (Rayleigh).
    assert np.sqrt((tilts**2).mean() / 2.0) == pytest.approx(np.radians(2.0), rel=0.02)


def test_breathing_displaces_the_second_views_surface_and_not_the_tip():
    views = measured_views(POSITIONS_DEG[:2], TROCAR, np.random.default_rng(0))
    moved = breathed(views, 0.069)
    for before, after in ((views.landmarks, moved.landmarks), (views.features, moved.features)):
        second = before.view == 1
        np.testing.assert_allclose(after.pixels[second], 1.069 * before.pixels[second])
        np.testing.assert_array_equal(after.pixels[~second], before.pixels[~second])
    assert all(np.array_equal(a.tip_px, b.tip_px) for a, b in zip(views.views, moved.views, strict=True))


def test_mottle_is_smooth_and_always_the_same():
    points = np.random.default_rng(0).uniform(-100.0, 100.0, (1000, 3))
    values = Mottle(6.0, 4, 1).at(points)
    assert values.min() >= 0.0
    assert values.max() <= 1.0
    np.testing.assert_array_equal(values, Mottle(6.0, 4, 1).at(points))
    assert np.abs(Mottle(6.0, 4, 1).at(points + 1e-3) - values).max() < 0.01
