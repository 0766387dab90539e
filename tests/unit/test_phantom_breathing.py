"""The breathing video's truth: where OpenCV projects the marks, and where the rendered marks are seen."""

import cv2
import numpy as np
import pytest

from glisson.core.camera import Camera
from glisson.phantom.breathing.exposing import Shutter
from glisson.phantom.breathing.motion import Breaths, Irregularity, Ventilator, draw_breaths, waveform
from glisson.phantom.breathing.occluders import Passing
from glisson.phantom.breathing.tissue import draw_tissue
from glisson.phantom.breathing.view import BreathingVideo
from glisson.phantom.photograph import Sensor

CAMERA = Camera(480, 270, [320.0, 322.0], [241.0, 134.0], [-0.22, 0.06, 5e-4, -4e-4, 0.0])
CLEAN = Sensor(blur_px=0.0, noise=0.0, shot_noise=0.0, fall_off=0.0)


def tissue(excursion_mm=20.0, marks=10):
    return draw_tissue(excursion_mm, np.random.default_rng(3), marks)


def centre_of_dark(image, place):
    """The middle of a dark spot near a place: the centroid of what is darker than half-way to its rim."""
    u, v = np.rint(place).astype(int)
    part = image[v - 11 : v + 12, u - 11 : u + 12].mean(axis=2)
    dark = np.clip(32.0 - part, 0.0, 15.0)
    down, across = np.mgrid[v - 11 : v + 12, u - 11 : u + 12]
    return np.array([(dark * across).sum(), (dark * down).sum()]) / dark.sum()


def test_a_still_mark_is_where_opencv_projects_it():
    video = BreathingVideo(CAMERA, tissue(), Ventilator(1.0, 0.0), 2)
    points = (
        np.column_stack([video.tissue.marks_mm, np.zeros(10)]) @ np.column_stack([video.tissue.axes, [0.0, 0.0, 1.0]]).T
        + video.tissue.middle_mm
    )
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), CAMERA.matrix, CAMERA.distortion)
    np.testing.assert_allclose(video.marks_px()[0], expected.reshape(-1, 2), atol=1e-9)


@pytest.mark.parametrize("shutter", [Shutter(25.0, 1e-4, 0.0), Shutter(25.0, 0.02, 0.03)])
def test_marks_are_seen_where_the_truth_says(shutter):
    """Also while they move by several px in an exposure and between the first and the last row."""
    moving = Ventilator(3.0, 0.5)
    video = BreathingVideo(CAMERA, tissue(), moving, 8, shutter, Sensor(1.0, 0.0, 0.0, 0.0))
    truth = video.marks_px()
    assert np.abs(np.diff(truth[:, 0, 1])).max() > 4.0
    off = np.array([
        [centre_of_dark(image, place) - place for place in places]
        for image, places in zip(video.images(), truth, strict=True)
    ])  # fmt: skip
    # A spot of some 9 px has a centroid within a fifth of a pixel of its middle; a wrong time would shift all together.
    assert np.abs(off).max() < 0.35
    assert np.abs(off.mean(axis=1)).max() < 0.06


def test_rolling_rows_are_later_further_down():
    still, rolling = (
        BreathingVideo(CAMERA, tissue(), Ventilator(1.0, 1.0), 10, Shutter(25.0, 1e-4, readout))
        for readout in (0.0, 0.03)
    )
    moved = rolling.marks_px() - still.marks_px()
    speed = np.gradient(still.marks_px()[:, :, 1], 0.04, axis=0)
    late = 0.03 * still.marks_px()[:, :, 1] / CAMERA.height
    middle = slice(2, -2)
    np.testing.assert_allclose(moved[middle, :, 1], (speed * late)[middle], atol=0.25 * np.abs(moved).max())


def test_a_long_exposure_averages():
    """By the sinc of the share of a stroke that it takes."""
    rate, exposure = 5.0, 0.08
    sharp, averaged = (
        np.ptp(BreathingVideo(CAMERA, tissue(2.0), Ventilator(rate), 200, Shutter(200.0, e, 0.0)).marks_px(), axis=0)
        for e in (1e-5, exposure)
    )
    np.testing.assert_allclose(averaged[:, 1] / sharp[:, 1], np.sinc(rate * exposure), rtol=0.02)


def test_breaths_have_the_phase_depth_and_level_that_they_say():
    breaths = Breaths(np.array([0.0, 4.0, 9.0]), np.array([1.0, 0.8]), np.array([0.0, 0.1, -0.1]))
    np.testing.assert_allclose(breaths.phase([0.0, 2.0, 6.5, 9.0]), [0.0, 0.5, 1.5, 2.0])
    np.testing.assert_allclose(breaths.along([0.0, 4.0, 9.0]), [0.0, 0.1, -0.1], atol=1e-12)
    np.testing.assert_allclose(breaths.across([0.0, 0.38 * 4.0, 4.0]), 0.0, atol=1e-12)
    assert waveform(np.array([0.38]))[0] == pytest.approx(1.0)
    drawn = draw_breaths(5.0, 60.0, Irregularity(), np.random.default_rng(0))
    assert drawn.starts_s[0] <= 0.0
    assert drawn.starts_s[-1] > 60.0
    assert np.diff(drawn.starts_s).std() > 0.2


def test_what_passes_covers_marks_and_the_truth_says_so():
    covering = Passing("blood", 0.0, 0.4, (240.0, 135.0), 60.0)
    clear, covered = (
        BreathingVideo(CAMERA, tissue(), Ventilator(1.0, 0.0), 10, Shutter(25.0), CLEAN, passing=things)
        for things in ((), (covering,))
    )
    visible = covered.marks_visible()
    assert clear.marks_visible().all()
    hidden = ~visible[5]
    assert hidden.any()
    assert visible[0].all()
    image = list(covered.images())[5]
    for place in covered.marks_px()[5][hidden]:
        u, v = np.rint(place).astype(int)
        assert image[v, u, 0] > 3 * image[v, u, 1]
