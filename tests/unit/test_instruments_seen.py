"""Instruments seen by a trocar's camera, against rendered truth, OpenCV's projection and closed forms."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.instruments import Instrument, InstrumentLibrary
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.intraoperative.instruments.circle_pose import circle_poses, conic_through
from glisson.intraoperative.instruments.colour_wheel import ColourWheel, ColourWheelParameters
from glisson.intraoperative.instruments.timeline import Use, total_seconds, uses
from glisson.io.instrument_files import EXAMPLE_LIBRARY, EXAMPLE_TROCAR, read_instruments, read_trocar
from glisson.phantom.photograph import Sensor
from glisson.phantom.wheel_scene import WheelScene, draw_scene
from glisson.phantom.wheel_view import PRINTED, WheelViews
from glisson.studies.trocar.recognition import recognise_views, recognition_values

LIBRARY = read_instruments(EXAMPLE_LIBRARY)
TROCAR = read_trocar(EXAMPLE_TROCAR)
RECOGNISER = ColourWheel(ColourWheelParameters())


@pytest.fixture(scope="module")
def views() -> WheelViews:
    return WheelViews(TROCAR.camera)


def plain_scene(seed: int = 3, name: str = "grasper") -> WheelScene:
    """Nothing over the wheel, even light and hardly any noise."""
    drawn = draw_scene(TROCAR, [LIBRARY.named(name)], np.random.default_rng([11, seed]), distance_mm=(90.0, 130.0))
    light, sensor = np.ones(3), Sensor(0.6, 1.0, 1.0, 0.0)
    drawn = replace(drawn, gamma=1.0)
    return replace(drawn, light=light, slope=np.zeros(2), sensor=sensor, fingers=(), blood=(), glare=(), shaft_mm=4.0)


def test_both_poses_of_a_circle_are_found():
    rng = np.random.default_rng(0)
    angles = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    tried = 0
    while tried < 100:
        centre = np.array([*rng.uniform(-60.0, 60.0, 2), rng.uniform(60.0, 250.0)])
        normal = rng.normal(size=3)
        normal *= -np.sign(normal @ centre) / np.linalg.norm(normal)
        if normal @ centre > -0.3 * np.linalg.norm(centre):
            continue
        tried += 1
        x = np.cross(normal, [1.0, 0.0, 0.0])
        x /= np.linalg.norm(x)
        rim = centre + 18.0 * (np.cos(angles)[:, None] * x + np.sin(angles)[:, None] * np.cross(normal, x))
        conic = conic_through(rim[:, :2] / rim[:, 2:])
        found = circle_poses(conic, 18.0)
        assert len(found) == 2
        assert min(np.abs(np.concatenate([c - centre, n - normal])).max() for c, n in found) < 1e-8
        # The other one has the same outline: its rim is on the same cone.
        for other, across in found:
            u = np.cross(across, [1.0, 0.0, 0.0])
            u /= np.linalg.norm(u)
            places = other + 18.0 * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * np.cross(across, u))
            cone = np.einsum("ni,ij,nj->n", places, conic, places) / np.einsum("ni,ni->n", places, places)
            assert np.abs(cone).max() < 1e-8 * np.abs(conic).max()


def test_rendered_wheels_are_where_opencv_projects_them(views):
    """The colours just inside and outside of each edge, at places that OpenCV projects."""
    scene = replace(plain_scene(), shaft_mm=0.01, sensor=Sensor(0.01, 0.0, 0.0, 0.0))
    image = views.view(scene).astype(float) / 255.0
    radius, camera = 0.5 * scene.instrument.wheel_mm, TROCAR.camera

    def seen(share: float, degrees: float) -> np.ndarray:
        angle = np.radians(degrees)
        point = scene.trocar_from_instrument.apply(radius * share * np.array([np.cos(angle), np.sin(angle), 0.0]))
        pixel, _ = cv2.projectPoints(point[None], np.zeros(3), np.zeros(3), camera.matrix, camera.distortion)
        column, row = np.rint(pixel.ravel()).astype(int)
        return image[row, column]

    for degrees in np.arange(5.0, 360.0, 10.0):
        ink = np.array(PRINTED[scene.instrument.colours[int(degrees // 60.0)]])
        assert np.allclose(seen(0.45, degrees), ink, atol=0.01)
        assert np.allclose(seen(0.73, degrees), ink, atol=0.01)
        assert np.allclose(seen(0.79, degrees), 0.86, atol=0.01)
        assert np.allclose(seen(0.87, degrees), 0.86, atol=0.01)
        assert np.allclose(seen(0.93, degrees), 0.05, atol=0.01)
        assert np.allclose(seen(0.97, degrees), 0.05, atol=0.01)


def test_drawn_axes_pass_the_pivot_by_the_play():
    rng, off = np.random.default_rng(1), []
    for _ in range(400):
        pose = draw_scene(TROCAR, LIBRARY.instruments, rng).trocar_from_instrument
        axis, away = pose.rotation[:, 2], TROCAR.pivot_mm - pose.translation_mm
        off.append(np.linalg.norm(away - (away @ axis) * axis))
        assert 0.0 < away @ axis < 300.0
        assert np.degrees(np.arccos(-axis @ TROCAR.axis)) <= 8.0 + 1e-9
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(TROCAR.play_mm * np.sqrt(2.0), rel=0.1)


@pytest.mark.parametrize("name", ["grasper", "fan retractor"])
def test_a_plain_view_gives_name_and_pose(views, name):
    scene = plain_scene(name=name)
    seen = RECOGNISER.recognise(views.view(scene), TROCAR, LIBRARY)
    true, found = scene.trocar_from_instrument, seen.trocar_from_instrument
    assert seen.instrument.name == name
    assert np.linalg.norm(found.translation_mm - true.translation_mm) < 0.1
    turned = np.degrees(np.arccos((np.trace(found.rotation.T @ true.rotation) - 1.0) / 2.0))
    assert turned < 1.5
    assert np.degrees(seen.angle_rad) == pytest.approx(np.degrees(np.arccos(-true.rotation[2, 2])), abs=0.3)
    off = seen.tip_mm - true.apply(scene.instrument.tip_mm)
    assert off @ np.linalg.solve(seen.tip_covariance_mm2, off) < 16.3  # one in 1,000 is farther


def test_views_with_hands_blood_glare_and_a_room():
    """Tips are within their ellipsoids as often as they should: 16 views, of which 90 % is 14.4 ± 1.2."""
    inputs = {"stream": 5, "first": 0}
    rows = [
        row
        for in_room, count in ((False, 12), (True, 4))
        for row in recognise_views({**inputs, "in_room": in_room, "count": count}, Path()).values["rows"]
    ]
    found = recognition_values(rows)
    assert (found["views"], found["wrong"]) == (16, 0)
    assert found["right"] >= 15
    assert found["tip_mm"]["median"] < 1.0
    assert sum(row["inside90"] for row in rows if row["right"]) >= 11
    assert found["placed"] >= 2
    assert found["room_tip_mm"]["median"] < 1.5


def test_the_camera_s_own_error_is_in_the_tip_s(views):
    image = views.view(plain_scene())
    camera = TROCAR.camera
    spread = np.diag([2.0, 2.0, 2.0, 2.0, 1e-3, 0.0, 0.0, 0.0, 0.0]) ** 2
    unsure = Camera(camera.width, camera.height, camera.focal_px, camera.centre_px, camera.distortion, spread)
    sure = RECOGNISER.recognise(image, TROCAR, LIBRARY).tip_covariance_mm2
    more = RECOGNISER.recognise(image, replace(TROCAR, camera=unsure), LIBRARY).tip_covariance_mm2
    assert np.linalg.eigvalsh(more - sure).min() > -1e-9
    assert np.trace(more) > np.trace(sure) + 0.05


def test_a_camera_s_gamma_moves_edges_but_not_the_wheel(views):
    """Gamma lets white grow by nearly half a pixel over each edge."""
    scene = replace(plain_scene(), gamma=2.2)
    seen = RECOGNISER.recognise(views.view(scene), TROCAR, LIBRARY)
    away = float(np.linalg.norm(scene.trocar_from_instrument.translation_mm))
    assert seen.distance_mm == pytest.approx(away, abs=0.1)


def test_a_tip_in_the_room_has_both_errors(views):
    seen = RECOGNISER.recognise(views.view(plain_scene()), TROCAR, LIBRARY)
    covariance = np.diag([1e-6, 1e-6, 1e-6, 0.04, 0.04, 0.04])
    room_from_trocar = RigidTransform("room", "trocar", np.eye(3), np.array([100.0, 0.0, 1000.0]), covariance)
    whole = room_from_trocar.after(seen.trocar_from_instrument)
    expected = room_from_trocar.point_covariance(seen.tip_mm, seen.tip_covariance_mm2)
    assert np.allclose(whole.apply(seen.instrument.tip_mm), room_from_trocar.apply(seen.tip_mm))
    assert np.allclose(whole.point_covariance(seen.instrument.tip_mm), expected)


def refused(image: np.ndarray, library: InstrumentLibrary = LIBRARY) -> StageFailed:
    with pytest.raises(StageFailed) as told:
        RECOGNISER.recognise(image, TROCAR, library)
    return told.value


def test_a_code_that_is_not_in_the_library_is_told(views):
    without = InstrumentLibrary(tuple(one for one in LIBRARY.instruments if one.name != "grasper"))
    failure = refused(views.view(plain_scene()), without)
    assert failure.status is Status.BAD_INPUT
    assert "not in the library" in str(failure)


def test_a_mirrored_image_is_told(views):
    failure = refused(np.ascontiguousarray(views.view(plain_scene())[:, ::-1]))
    assert failure.status is Status.BAD_INPUT
    assert "mirrored" in str(failure)


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_a_wheel_of_another_size_contradicts_the_pivot(views, factor):
    scene = plain_scene()
    given = Instrument("grasper", 330.0, scene.instrument.colours, factor * scene.instrument.wheel_mm)
    failure = refused(views.view(scene), InstrumentLibrary((given,)))
    assert failure.status is Status.BAD_INPUT
    assert f"not {given.wheel_mm:g} mm wide" in str(failure)
    # The sentence says which size would fit.
    fitting = float(str(failure).split(" but ")[1].split(" mm")[0])
    assert fitting == pytest.approx(scene.instrument.wheel_mm, rel=0.15)


def test_no_wheel_is_told(views):
    scene = plain_scene()
    far = RigidTransform("trocar", "instrument", scene.trocar_from_instrument.rotation, [900.0, 0.0, 100.0])
    failure = refused(views.view(replace(scene, trocar_from_instrument=far)))
    assert failure.status is Status.UNOBSERVABLE
    stripes = np.tile(np.repeat(np.array([20, 230], dtype=np.uint8), 40), 16)[None, :, None]
    noise = np.random.default_rng(2).integers(0, 256, (960, 1280, 3))
    for empty in (np.zeros((960, 1280, 3)), np.full((960, 1280, 3), 255), stripes * np.ones((960, 1, 3)), noise):
        assert refused(np.ascontiguousarray(empty, dtype=np.uint8)).status is Status.UNOBSERVABLE


def test_an_image_of_another_camera_is_told():
    with pytest.raises(BadInput, match="640 × 480 px, the trocar's camera 1280 × 960"):
        RECOGNISER.recognise(np.zeros((480, 640, 3), dtype=np.uint8), TROCAR, LIBRARY)


def test_uses_end_after_a_gap_or_with_another_instrument():
    times = [0.0, 0.5, 1.0, 1.5, 2.0, 5.0, 5.5, 6.0]
    names = ["hook", None, "hook", "scissors", "hook", "hook", None, "hook"]
    found = uses(times, names, 1.0)
    assert found == (
        Use("hook", 0.0, 1.0, 2),
        Use("scissors", 1.5, 1.5, 1),
        Use("hook", 2.0, 2.0, 1),
        Use("hook", 5.0, 6.0, 2),
    )
    assert total_seconds(found) == {"hook": 2.0, "scissors": 0.0}
    assert uses([], []) == ()
