"""Rendered views taken all the way from pixels, and what is told where an image allows no pose."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trocar_views
from glisson.core import BadInput
from glisson.core.crosses import CrossLayout
from glisson.core.registry import make_technique
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.phantom.photograph import Sensor
from glisson.phantom.room_scene import INKS, PAPER, bare_scene, draw_scene
from glisson.phantom.room_view import RoomViews
from trocar_views import CAMERA


@pytest.fixture
def localiser():
    return make_technique("localiser", "global", {}, "test")


def test_the_renderer_shows_colours_where_opencv_projects_them():
    layout, true = trocar_views.layout(), trocar_views.pose(1)
    light = trocar_views.views().light(bare_scene(trocar_views.ROOM, layout), true, np.random.default_rng(0))
    inverse = true.inverse()
    for cross in layout.crosses:
        flat = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0], [1.0, 1.0]]) / 3.0
        points = inverse.apply(cross.in_room(flat * cross.size_mm))
        pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), CAMERA.matrix, CAMERA.distortion)
        expected = [*(INKS[name] for name in cross.colours), PAPER]
        for (u, v), colour in zip(np.rint(pixels.reshape(-1, 2)).astype(int), expected, strict=True):
            if 0 <= u < CAMERA.width and 0 <= v < CAMERA.height:
                assert np.allclose(light[v, u], colour, atol=1e-9)


@pytest.mark.parametrize("gamma", [1.0, 2.2])
@pytest.mark.parametrize("technique", ["global", "guess-database"])
def test_poses_from_pixels(technique, gamma):
    localiser = make_technique("localiser", technique, {}, "test")
    layout = trocar_views.layout()
    for seed in range(6):
        true = trocar_views.pose(seed)
        found = localiser.localise(trocar_views.view(layout, true, seed, gamma), CAMERA, layout)
        assert found.status is Status.CONVERGED
        assert np.linalg.norm(found.room_from_trocar.translation_mm - true.translation_mm) < found.position_bound_mm < 5
        turned = Rotation.from_matrix(found.room_from_trocar.rotation @ true.rotation.T).magnitude()
        assert turned < found.angle_bound_rad < np.deg2rad(1.0)


def test_a_room_in_use_is_right_or_flagged(localiser):
    layout, good = trocar_views.layout(), 0
    for seed in range(20):
        rng = np.random.default_rng([seed, 9])
        true = trocar_views.ROOM.draw_pose(rng)
        scene = draw_scene(trocar_views.ROOM, layout, true, rng)
        image = trocar_views.views().view(scene, true, Sensor(rng.uniform(0.5, 1.0), 3.0), rng)
        found = localiser.localise(image, CAMERA, layout)
        if found.status is Status.CONVERGED:
            good += 1
            assert np.linalg.norm(found.room_from_trocar.translation_mm - true.translation_mm) < 5.0
    assert good >= 5


def test_what_the_bounds_do_not_count_is_told(localiser):
    places = tuple(
        replace(cross, room_from_cross=replace(cross.room_from_cross, covariance=1e-6 * np.eye(6)))
        for cross in trocar_views.layout().crosses
    )
    layout, camera = CrossLayout(places), replace(CAMERA, covariance=1e-8 * np.eye(9))
    image = trocar_views.view(layout, trocar_views.pose(2), 2)
    assert localiser.localise(image, camera, layout).notes == ()
    told = localiser.localise(image, CAMERA, trocar_views.layout()).notes
    assert [note.partition(" no covariance")[0] for note in told] == ["The camera has", "The crosses' places have"]
    other_lens = localiser.localise(image, replace(camera, distortion=np.zeros(5)), layout)
    assert "times as far off as they should be" in other_lens.notes[0]


def test_ink_that_has_grown_is_told_from_a_pose_that_is_off(localiser):
    layout, true = trocar_views.layout(), trocar_views.pose(2)
    noises, counts = [], []
    for gamma in (1.0, 2.2):
        found = localiser.localise(trocar_views.view(layout, true, 2, gamma), CAMERA, layout)
        noises.append(found.noise_px)
        counts.append(len(found.corners_px))
    assert noises[1] < 1.5 * noises[0]
    assert counts[1] >= 0.95 * counts[0]


def test_edges_are_measured_to_hundredths_of_a_pixel(localiser):
    layout, true = trocar_views.layout(), trocar_views.pose(2)
    found = localiser.localise(trocar_views.view(layout, true, 2), CAMERA, layout)
    corners = np.concatenate([trocar_views.views().corners(cross, true) for cross in layout.crosses])
    off = np.linalg.norm(found.corners_px[:, None] - corners[None], axis=2).min(axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.1
    assert found.noise_px < 0.1


def test_images_that_allow_no_pose(localiser):
    layout, true = trocar_views.layout(), trocar_views.pose(3)
    image = trocar_views.view(layout, true, 3)
    mirrored = localiser.localise(np.ascontiguousarray(image[:, ::-1]), CAMERA, layout)
    assert (mirrored.status, mirrored.room_from_trocar) == (Status.BAD_INPUT, None)
    assert "mirror" in mirrored.message
    nothing = localiser.localise(np.zeros_like(image), CAMERA, layout)
    assert nothing.status is Status.UNOBSERVABLE
    assert "No cross" in nothing.message
    grey = localiser.localise(np.repeat(image.mean(axis=2, keepdims=True).astype(np.uint8), 3, axis=2), CAMERA, layout)
    assert "which is grey" in grey.message
    one = localiser.localise(image, CAMERA, CrossLayout(layout.crosses[:1]))
    assert one.status is Status.UNOBSERVABLE
    assert "Only one cross" in one.message
    assert "outlines of crosses are not in the layout" in one.message


@pytest.mark.parametrize("factor", [0.7, 0.97, 1.05])
def test_crosses_of_another_size_are_told(localiser, factor):
    layout, true = trocar_views.layout(), trocar_views.pose(4)
    image = trocar_views.view(layout, true, 4)
    given = CrossLayout(tuple(replace(cross, size_mm=cross.size_mm / factor) for cross in layout.crosses))
    told = localiser.localise(image, CAMERA, given)
    assert told.status is Status.BAD_INPUT
    # Crosses that do not fit at all are known by their outlines only, to a pixel in about sixty.
    assert float(told.message.split()[3]) == pytest.approx(factor, rel=1.0 / 60.0)


def test_a_layout_that_is_not_the_rooms_is_told(localiser):
    layout, true = trocar_views.layout(), trocar_views.pose(5)
    image = trocar_views.view(layout, true, 5)
    moved = [
        replace(cross, room_from_cross=RigidTransform("room", "cross", cross.room_from_cross.rotation, [x, y, 2900.0]))
        for cross, (x, y) in zip(layout.crosses, np.random.default_rng(1).uniform(-900.0, 900.0, (5, 2)), strict=True)
    ]
    told = localiser.localise(image, CAMERA, CrossLayout(tuple(moved)))
    assert told.status is Status.UNOBSERVABLE
    assert "No pose explains" in told.message


def test_an_image_of_another_camera_is_refused(localiser):
    layout = trocar_views.layout()
    for image in (np.zeros((240, 320, 3), dtype=np.uint8), np.zeros((480, 640), dtype=np.uint8)):
        with pytest.raises(
            BadInput, match=r"(320 × 240 px|640 × 480 px and grey), but its camera takes colour images of 640 × 480 px"
        ):
            localiser.localise(image, CAMERA, layout)


def test_what_is_covered_is_not_visible():
    layout = trocar_views.layout(1)
    true = RigidTransform("room", "trocar", np.eye(3), [-700.0, -500.0, 1000.0])
    scene = bare_scene(trocar_views.ROOM, layout)
    cameras = RoomViews(CAMERA)
    assert cameras.visible(scene, layout.crosses[0], true)
    rod = np.array([[-700.0, -500.0, 2000.0, -700.0, -500.0, 2001.0, 30.0]])
    covered = replace(scene, rods=rod, rod_colours=np.zeros((1, 3)))
    assert not cameras.visible(covered, layout.crosses[0], true)
