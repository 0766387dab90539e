"""`glisson calibrate`: from files to cameras, poses and pictures, and what is refused."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from board_scene import (
    CAMERA,
    CAMERA_FROM_MARKER,
    apart,
    photograph_of,
    seen_boards,
    squared_deviations,
    tilted_poses,
    tracked_boards,
)
from glisson.core import RigidTransform
from glisson.intraoperative.cameras.boards import Board
from glisson.io.camera_files import read_camera, write_camera
from glisson.io.pose_files import read_pose, read_poses, write_pose

SMALL = type(CAMERA)(480, 360, [370.0, 371.0], [236.0, 182.0], [-0.2, 0.05, 0.0, 0.0, 0.0])
BOARD = Board("chessboard", 8, 5, 5.0)


def write_matrix(path, pose):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = pose.rotation, pose.translation_mm
    np.savetxt(path, matrix, fmt="%.6f")


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """Twelve views in corner files with tracked poses of six digits."""
    folder = tmp_path_factory.mktemp("session")
    rng = np.random.default_rng(1)
    for number, view in enumerate(tracked_boards(rng, tilted_poses(rng, 12), 5e-4, 0.1, True)):
        np.savetxt(folder / f"corners.{number}.txt", view.board.pixels)
        np.savetxt(folder / f"points.{number}.txt", view.board.points_mm)
        write_matrix(folder / f"scope.{number}.txt", view.room_from_marker)
        write_matrix(folder / f"board.{number}.txt", view.room_from_base)
    return folder


def files(session, name, count=12):
    return [session / f"{name}.{number}.txt" for number in range(count)]


def corners(session, count=12):
    return ["--corners", *files(session, "corners", count), "--points", *files(session, "points", count)]


def test_camera_then_hand_eye_then_scope(session, tmp_path, glisson):
    out = tmp_path / "out"
    code, said = glisson("calibrate", "camera", *corners(session), "--size", "1440x1080", "--out", out)
    assert (code, said["status"], said["views"]) == (0, "converged", 12)
    camera = read_camera(said["file"])
    assert camera.focal_px.tolist() == said["focal_px"]
    assert np.abs(camera.focal_px - CAMERA.focal_px).max() < 8.0
    assert cv2.imread(said["picture"]) is not None
    tracked = ["--poses", *files(session, "scope"), "--board-poses", *files(session, "board")]
    code, said = glisson(
        "calibrate", "hand-eye", "--camera", out / "camera.toml", *corners(session), *tracked, "--out", out
    )
    assert code == 0, said
    pose = read_pose(said["file"])
    assert squared_deviations(apart(pose, CAMERA_FROM_MARKER), pose.covariance) < 22.5  # 99.9 % of six
    assert np.linalg.norm(pose.translation_mm - CAMERA_FROM_MARKER.translation_mm) < 1.5
    assert said["rms_mm"] < 0.5
    assert cv2.imread(said["picture"]) is not None
    tip = CAMERA_FROM_MARKER.inverse().apply([0.0, 0.0, 5.0])
    code, said = glisson("calibrate", "scope", "--hand-eye", said["file"], "--tip", ",".join(f"{x:.4f}" for x in tip))
    assert (code, said["oblique_deg"]) == (0, None)
    assert np.linalg.norm(np.array(said["tip_mm"]) - [0.0, 0.0, 5.0]) < 1.5


def test_camera_from_images(tmp_path, glisson):
    rng = np.random.default_rng(2)
    folder = tmp_path / "images"
    folder.mkdir()
    for number, pose in enumerate(tilted_poses(rng, 6, (20.0, 35.0), BOARD, SMALL)):
        image, _ = photograph_of(BOARD, pose, rng, SMALL, samples=2)
        cv2.imwrite(str(folder / f"view-{number}.png"), image[:, :, ::-1])
    cv2.imwrite(str(folder / "view-9.png"), np.full((360, 480, 3), 90, dtype=np.uint8))
    words = ["calibrate", "camera", "--board", "chessboard:8x5:5", "--images", folder, "--out", tmp_path / "out"]
    code, said = glisson(*words)
    assert code == 0, said
    assert said["views"] == 6
    assert "No board was found in view-9.png." in said["notes"]
    assert np.abs(np.array(said["focal_px"]) - SMALL.focal_px).max() < 8.0
    assert said["rms_px"] < 0.2
    cv2.imwrite(str(folder / "view-7.png"), np.zeros((100, 100, 3), dtype=np.uint8))
    code, said = glisson(*words)
    assert (code, said["status"]) == (2, "bad_input")
    assert "one size" in said["message"]


def test_pivot_and_scope_of_poses(tmp_path, glisson):
    rng = np.random.default_rng(3)
    tip, spin = np.array([2.0, 3.0, 250.0]), []
    for folder, turns in (
        ("swing", [Rotation.from_rotvec([*rng.uniform(-0.4, 0.4, 2), 0.0]) for _ in range(20)]),
        ("spin", [Rotation.from_rotvec([0.0, 0.0, angle]) for angle in np.linspace(0.0, 5.0, 12)]),
    ):
        (tmp_path / folder).mkdir()
        for number, turn in enumerate(turns):
            pose = RigidTransform("room", "marker", turn.as_matrix(), -turn.apply(tip) + 0.05 * rng.normal(size=3))
            write_matrix(tmp_path / folder / f"{number}.txt", pose)
            spin.append(pose)
    code, said = glisson("calibrate", "pivot", "--poses", tmp_path / "swing")
    assert (code, said["used"]) == (0, 20)
    assert np.linalg.norm(np.array(said["tip_mm"]) - tip) < 0.2
    tilted = Rotation.from_rotvec([0.0, np.radians(-30.0), 0.0]).as_matrix()
    # The glass tip is 5 mm before the centre of projection.
    hand_eye = RigidTransform(
        "camera", "marker", tilted, [0.0, 0.0, 5.0] - tilted @ tip, np.diag([1e-3] * 3 + [0.1] * 3) ** 2
    )
    write_pose(tmp_path / "hand-eye.toml", hand_eye)
    code, said = glisson(
        "calibrate", "scope", "--hand-eye", tmp_path / "hand-eye.toml", "--tip-poses", tmp_path / "swing",
        "--spin-poses", tmp_path / "spin",
    )  # fmt: skip
    assert code == 0, said
    assert said["oblique_deg"] == pytest.approx(30.0, abs=0.01)
    assert said["tip_mm"] == pytest.approx(hand_eye.apply(tip), abs=0.2)


@pytest.mark.parametrize(
    ("words", "code", "status", "sentence"),
    [
        (["camera"], 2, "bad_input", "either --images with --board"),
        (["camera", "--images", "x.png"], 2, "bad_input", "--board"),
        (["camera", "--board", "chessboard:9x6:5", "--images", "x.png"], 2, "bad_input", "does not exist"),
        (["camera", "--board", "chess:9x6:5", "--images", "x.png"], 2, "bad_input", "A board is written"),
        (["pivot", "--poses", "nan.txt"], 2, "bad_input", "pose 2 is not finite (NaN)"),
        (["pivot", "--poses", "short.txt"], 2, "bad_input", "4 lines of 4 numbers"),
        (["pivot", "--poses", "scaled.txt"], 2, "bad_input", "no rigid transform"),
        (["pivot", "--poses", "words.txt"], 2, "bad_input", "line 1 holds what is no number"),
        (["pivot", "--poses", "still.txt"], 1, "unobservable", "nearly parallel"),
        (["pivot"], 2, "bad_input", "--poses"),
        (["scope", "--hand-eye", "x.toml"], 2, "bad_input", "--tip"),
        (["scope", "--hand-eye", "other.toml", "--tip", "0,0,1"], 2, "bad_input", "not camera from marker"),
        (["hand-eye", "--camera", "none.toml", "--poses", "still.txt"], 2, "bad_input", "does not exist"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_one_sentence(words, code, status, sentence, tmp_path, monkeypatch, glisson):
    monkeypatch.chdir(tmp_path)
    np.savetxt("still.txt", np.tile(np.eye(4), (8, 1)))
    np.savetxt("nan.txt", np.concatenate([np.eye(4), np.full((4, 4), np.nan)]))
    np.savetxt("short.txt", np.eye(3))
    np.savetxt("scaled.txt", np.diag([2.0, 2.0, 2.0, 1.0]))
    (tmp_path / "words.txt").write_text("a pose\n")
    write_pose("other.toml", RigidTransform("room", "marker", np.eye(3), np.zeros(3)))
    ended, said = glisson("calibrate", *words)
    assert (ended, said["status"]) == (code, status), said
    assert sentence in said["message"]
    assert not (tmp_path / "calibration").exists()


def test_poses_that_are_not_as_many_as_images(session, tmp_path, glisson):
    write_camera(tmp_path / "camera.toml", CAMERA)
    words = ["calibrate", "hand-eye", "--camera", tmp_path / "camera.toml", "--out", tmp_path / "out"]
    code, said = glisson(*words, *corners(session, 5), "--poses", *files(session, "scope", 4))
    assert (code, said["status"]) == (2, "bad_input")
    assert "cannot belong to 5 images" in said["message"]
    still = ["--poses", *[session / "scope.0.txt"] * 5]
    code, said = glisson(*words, *corners(session, 5), *still)
    assert (code, said["status"]) == (1, "unobservable")
    assert "nearly parallel: turn the scope about another axis" in said["message"]
    assert not (tmp_path / "out").exists()


def test_cameras_and_poses_written_are_read_again(tmp_path):
    camera = type(CAMERA)(
        640, 480, [500.1, 501.2], [320.3, 240.4], [0.1, 0.2, 0.3, 0.4, 0.5], np.diag(np.arange(1.0, 10.0))
    )
    write_camera(tmp_path / "camera.toml", camera)
    again = read_camera(tmp_path / "camera.toml")
    for name in ("width", "height", "focal_px", "centre_px", "distortion", "covariance"):
        np.testing.assert_array_equal(getattr(again, name), getattr(camera, name))
    pose = seen_pose = RigidTransform("room", "marker", Rotation.from_rotvec([0.1, 0.2, 0.3]).as_matrix(), [1.0, 2, 3])
    write_pose(tmp_path / "pose.toml", pose)
    np.testing.assert_array_equal(read_pose(tmp_path / "pose.toml").rotation, seen_pose.rotation)
    rows = np.eye(4).ravel()[None] + np.array([[0.0] * 3 + [number] + [0.0] * 12 for number in range(3)])
    np.savetxt(tmp_path / "log.txt", rows, header="one matrix a line", delimiter=",")
    assert [one.translation_mm[0] for one in read_poses([tmp_path / "log.txt"], "room", "marker")] == [0.0, 1.0, 2.0]


def test_corner_files_need_the_image_size(session, tmp_path, glisson):
    code, said = glisson("calibrate", "camera", *corners(session), "--out", tmp_path / "out")
    assert (code, said["status"]) == (2, "bad_input")
    assert "--size" in said["message"]


def test_seen_boards_are_the_camera_s():
    """The truth of these tests is OpenCV's projection, too."""
    rng = np.random.default_rng(4)
    pose = tilted_poses(rng, 1)[0]
    view = seen_boards(rng, [pose], 0.0)[0]
    turn, _ = cv2.Rodrigues(pose.rotation)
    pixels, _ = cv2.projectPoints(view.points_mm, turn, pose.translation_mm, CAMERA.matrix, CAMERA.distortion)
    assert np.allclose(view.pixels, pixels.reshape(-1, 2), atol=1e-8)
