"""The renderer's optics against OpenCV's, with which it shares no code."""

import cv2
import numpy as np
import pytest

from glisson.core.camera import Camera
from glisson.phantom.optics import ray_slopes, seen_at, sensor_slopes
from glisson.phantom.photograph import Sensor, averaged, photographed

CAMERA = Camera(160, 120, [130.0, 133.0], [79.0, 61.0], [-0.25, 0.08, 2e-3, -1e-3, -0.01])


def test_points_are_seen_where_opencv_projects_them():
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-0.6, 0.6, (200, 2)), np.ones(200)]) * rng.uniform(20.0, 200.0, (200, 1))
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), CAMERA.matrix, CAMERA.distortion)
    assert np.allclose(seen_at(CAMERA, points), expected.reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize("samples", [1, 3])
def test_rays_meet_the_sensor_where_they_should(samples):
    slopes = sensor_slopes(CAMERA, samples)
    points = np.concatenate([slopes.reshape(-1, 2), np.ones((slopes[..., 0].size, 1))], axis=1)
    pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), CAMERA.matrix, CAMERA.distortion)
    pixels = pixels.reshape(120, samples, 160, samples, 2).mean(axis=(1, 3))
    assert np.allclose(pixels[..., 0], np.arange(160)[None, :], atol=1e-8)
    assert np.allclose(pixels[..., 1], np.arange(120)[:, None], atol=1e-8)


def test_no_ray_where_barrel_distortion_ends():
    assert np.isnan(ray_slopes(CAMERA, [[5000.0, 61.0]])).all()


def test_noise_as_asked_for():
    sensor = Sensor(blur_px=0.0, noise=3.0, shot_noise=4.0, fall_off=0.0)
    light = np.full((300, 300, 3), 0.5)
    picture = photographed(light, sensor, np.random.default_rng(2)).astype(float)
    assert picture.mean() == pytest.approx(127.5, abs=0.05)
    assert picture.var() == pytest.approx(9.0 + 8.0 + 1.0 / 12.0, rel=0.02)
    assert np.allclose(averaged(np.arange(48.0).reshape(4, 4, 3), 2)[0, 0], [7.5, 8.5, 9.5])
