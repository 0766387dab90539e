"""Markers followed: against images shifted by known amounts, and against the truth of a rendered video."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy import ndimage
from scipy.spatial.transform import Rotation

from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.registry import make_technique
from glisson.core.tracks import PointState, Tracks
from glisson.core.transform import RigidTransform
from glisson.intraoperative.tracks.markers import corners, dark_spots
from glisson.intraoperative.tracks.millimetres import at_distance, on_plane, scaled
from glisson.io.track_files import read_tracks, write_tracks
from glisson.phantom.breathing.exposing import Shutter
from glisson.phantom.breathing.motion import Irregularity, draw_breaths
from glisson.phantom.breathing.occluders import draw_glare, draw_passing
from glisson.phantom.breathing.tissue import draw_tissue
from glisson.phantom.breathing.view import BreathingVideo

CAMERA = Camera(960, 540, [640.0, 640.0], [482.0, 268.0], [-0.22, 0.06, 5e-4, -4e-4, 0.0])


@pytest.fixture(scope="module")
def tracker():
    return make_technique("marker-tracker", "lucas-kanade", {}, "here")


def picture(seed=0):
    rng = np.random.default_rng(seed)
    smooth = cv2.GaussianBlur(rng.uniform(0.0, 255.0, (270, 480)).astype(np.float32), (0, 0), 3.0)
    grey = cv2.normalize(smooth, None, 40.0, 200.0, cv2.NORM_MINMAX)
    return np.repeat(grey[:, :, None], 3, axis=2)


def shifted(image, shift, gain=1.0, offset=0.0):
    # Splines, since OpenCV's warp rounds to a 32nd of a pixel.
    moved = ndimage.shift(image, (shift[1], shift[0], 0.0), order=5, mode="mirror")
    return np.clip(np.rint(gain * moved + offset), 0, 255).astype(np.uint8)


MARKERS = np.array([[100.0, 100.0], [240.0, 60.0], [333.5, 201.25], [400.0, 130.0], [150.0, 210.0]])


def test_known_shifts_are_found_whatever_the_light(tracker):
    image = picture()
    shifts = np.array([[0.0, 0.0], [0.3, -0.2], [4.4, 2.1], [12.5, -6.25], [20.2, -13.7]])
    frames = [
        (0.04 * n, shifted(image, shift, 1.0 - 0.06 * n, 4.0 * n)) for n, shift in enumerate(shifts)
    ]  # fmt: skip
    tracks = tracker.track(iter(frames), MARKERS)
    assert (tracks.states == PointState.FOLLOWED).all()
    np.testing.assert_allclose(
        tracks.places - MARKERS, np.broadcast_to(shifts[:, None], tracks.places.shape), atol=0.04
    )


def test_a_covered_marker_is_lost_and_found_again_and_a_new_scene_is_not_taken_for_it(tracker):
    image = shifted(picture(), (0.0, 0.0))
    covered = image.copy()
    covered[80:121, 80:121] = 30
    other = shifted(picture(9), (0.0, 0.0))
    tracks = tracker.track(iter([(0.0, image), (0.1, covered), (0.2, covered), (0.3, image), (0.4, other)]), MARKERS)
    assert tracks.states[:4, 0].tolist() == [0, 2, 2, 1]
    np.testing.assert_allclose(tracks.places[3, 0], MARKERS[0], atol=0.02)
    assert np.isnan(tracks.places[1, 0]).all()
    assert (tracks.states[:4, 1:] == PointState.FOLLOWED).all()
    assert (tracks.states[4] == PointState.LOST).all()


@pytest.fixture(scope="module")
def rendered():
    rng = np.random.default_rng(21)
    breaths = draw_breaths(4.0, 5.0, Irregularity(), rng)
    shape = (540, 960)
    return BreathingVideo(
        CAMERA, draw_tissue(20.0, rng), breaths, 125, Shutter(25.0, 0.012, 0.02),
        glare=draw_glare(shape, rng), passing=draw_passing(5.0, shape, rng), seed=21,
    )  # fmt: skip


def test_marks_of_a_breathing_liver_are_followed_through_glare_blood_and_an_instrument(rendered, tracker):
    images = list(rendered.images())
    truth, visible = rendered.marks_px(), rendered.marks_visible()
    assert not visible.all()
    found = dark_spots(images[0], 20)
    assert len(found) >= 16
    apart = np.linalg.norm(found[:, None] - truth[0][None], axis=2)
    number = apart.argmin(axis=1)
    assert len(set(number.tolist())) == len(found)
    assert apart.min(axis=1).max() < 3.0
    tracks = tracker.track(((n / 25.0, image) for n, image in enumerate(images)), found)
    off = tracks.places - found - (truth - truth[0])[:, number]
    size = np.linalg.norm(off, axis=2)
    assert np.nanmedian(size) < 0.05
    assert np.nanpercentile(size, 99.0) < 0.7
    assert np.nanmax(size) < 2.5
    # What is covered is not claimed to be seen, and most of what is not covered is seen.
    assert (tracks.seen & ~visible[:, number]).sum() <= 2
    assert tracks.seen.mean() > visible[:, number].mean() - 0.08
    assert (tracks.states == PointState.FOUND_AGAIN).any()
    # In units of the stated covariance most errors are about one.
    units = off[1:] / np.sqrt(np.einsum("nmii->nmi", tracks.covariance[1:]))
    assert 0.6 < 1.4826 * np.nanmedian(np.abs(units)) < 1.5


def test_corners_keep_off_reflexes(rendered):
    image = next(iter(rendered.images()))
    found = corners(image, 30)
    grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
    u, v = np.rint(found).astype(int).T
    assert len(found) == 30
    assert (grey[v, u] < 200).all()


def test_what_cannot_be_followed_is_told(tracker):
    image = shifted(picture(), (0.0, 0.0))
    with pytest.raises(BadInput, match="px from the border"):
        tracker.track(iter([(0.0, image)]), np.array([[5.0, 100.0]]))
    with pytest.raises(BadInput, match="finite"):
        tracker.track(iter([(0.0, image)]), np.array([[np.nan, 100.0]]))
    with pytest.raises(StageFailed, match="fewer than two frames"):
        tracker.track(iter([(0.0, image)]), MARKERS)
    with pytest.raises(StageFailed, match="Only 0 dark spots"):
        dark_spots(np.full((200, 300, 3), 90, dtype=np.uint8), 5)
    with pytest.raises(BadInput, match="one or more"):
        corners(image, 0)


def some_tracks(frames=6):
    rng = np.random.default_rng(2)
    places = rng.uniform(200.0, 700.0, (frames, 4, 2))
    root = rng.normal(size=(frames, 4, 2, 2))
    states = np.zeros((frames, 4), dtype=np.int8)
    states[2, 1], states[3, 1] = PointState.LOST, PointState.FOUND_AGAIN
    return Tracks(0.04 * np.arange(frames), places, root @ np.swapaxes(root, 2, 3), states)


def test_tracks_come_back_from_their_file(tmp_path):
    tracks = some_tracks()
    path = tmp_path / "tracks.csv"
    write_tracks(path, tracks)
    again = read_tracks(path)
    np.testing.assert_array_equal(again.states, tracks.states)
    np.testing.assert_allclose(again.places, tracks.places, rtol=1e-5)
    np.testing.assert_allclose(again.covariance, tracks.covariance, rtol=1e-5, atol=1e-6)
    assert again.unit == "px"
    write_tracks(path, scaled(tracks, 0.5))
    assert read_tracks(path).unit == "mm"
    np.testing.assert_allclose(read_tracks(path).places, 0.5 * tracks.places, rtol=1e-5)
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:-2]) + "\n")
    with pytest.raises(BadInput, match="one line for each marker"):
        read_tracks(path)
    path.write_text("a,b\n1,2\n")
    with pytest.raises(BadInput, match="not a table of tracks"):
        read_tracks(path)
    with pytest.raises(BadInput, match="cannot be read"):
        read_tracks(tmp_path / "none.csv")


def test_markers_on_a_plane_from_a_scope_that_moves():
    """Points of a plane in the room, projected by OpenCV with poses of their own, come back with their covariance."""
    rng = np.random.default_rng(5)
    normal, origin = np.array([0.1, -0.2, 1.0]), np.array([3.0, 4.0, 120.0])
    points = rng.uniform(-30.0, 30.0, (5, 3))
    points -= ((points - origin) @ normal / (normal @ normal))[:, None] * normal
    poses, places = [], []
    for _ in range(3):
        turn = Rotation.from_rotvec(rng.normal(0.0, 0.1, 3)).as_matrix()
        shift = rng.normal(0.0, 5.0, 3)
        poses.append(RigidTransform("room", "camera", turn, shift))
        inverse = poses[-1].inverse()
        turned = cv2.Rodrigues(inverse.rotation)[0]
        seen, _ = cv2.projectPoints(points, turned, inverse.translation_mm, CAMERA.matrix, CAMERA.distortion)
        places.append(seen.reshape(-1, 2))
    spread = np.broadcast_to(0.25 * np.eye(2), (3, 5, 2, 2))
    tracks = Tracks(np.arange(3.0), np.array(places), spread, np.zeros((3, 5), dtype=np.int8))
    found, covariance = on_plane(tracks, CAMERA, poses, origin, normal)
    np.testing.assert_allclose(found, np.broadcast_to(points, found.shape), atol=1e-6)
    np.testing.assert_allclose(covariance @ normal, 0.0, atol=1e-6)
    noisy = Tracks(np.arange(3.0), np.array(places) + rng.normal(0.0, 0.5, (3, 5, 2)), spread, np.zeros((3, 5)))
    off = on_plane(noisy, CAMERA, poses, origin, normal)[0] - points
    # Two degrees of freedom in the plane: the mean of the squared distances in units of the covariance is about two.
    squares = [o @ np.linalg.pinv(c) @ o for o, c in zip(off.reshape(-1, 3), covariance.reshape(-1, 3, 3), strict=True)]
    assert 0.8 < np.mean(squares) < 3.8
    with pytest.raises(BadInput, match="2 poses for 3 frames"):
        on_plane(tracks, CAMERA, poses[:2], origin, normal)


def test_tracks_at_a_distance_from_a_calibrated_camera():
    """Against points of a plane across the axis, projected by OpenCV."""
    rng = np.random.default_rng(6)
    points = np.concatenate([rng.uniform(-40.0, 40.0, (3, 4, 2)), np.full((3, 4, 1), 90.0)], axis=2)
    seen, _ = cv2.projectPoints(points.reshape(-1, 3), np.zeros(3), np.zeros(3), CAMERA.matrix, CAMERA.distortion)
    spread = np.broadcast_to(0.25 * np.eye(2), (3, 4, 2, 2))
    tracks = Tracks(np.arange(3.0), seen.reshape(3, 4, 2), spread, np.zeros((3, 4)))
    found = at_distance(tracks, CAMERA, 90.0)
    assert found.unit == "mm"
    np.testing.assert_allclose(found.places, points[:, :, :2], atol=1e-6)
    # Barrel distortion makes pixels larger outwards than the 90 / 640 mm that they have on the axis.
    sigma = np.sqrt(np.linalg.det(found.covariance)) / 0.25
    assert (sigma > (90.0 / 640.0) ** 2).all()
    lost = at_distance(replace(tracks, states=np.full((3, 4), PointState.LOST)), CAMERA, 90.0)
    assert not lost.seen.any()
    with pytest.raises(BadInput, match="distance must be positive"):
        at_distance(tracks, CAMERA, 0.0)


def test_tracks_must_make_sense():
    tracks = some_tracks()
    with pytest.raises(BadInput, match="increase"):
        Tracks(np.zeros(6), tracks.places, tracks.covariance, tracks.states)
    with pytest.raises(BadInput, match="not finite"):
        Tracks(tracks.times_s, tracks.places, tracks.covariance, np.zeros((6, 4)))
    with pytest.raises(BadInput, match="in mm already"):
        scaled(scaled(tracks, 1.0), 1.0)
    with pytest.raises(BadInput, match="must be positive"):
        scaled(tracks, -1.0)
