"""Calibration of cameras from boards whose views are rendered with the renderer's own optics."""

import cv2
import numpy as np
import pytest
from scipy.stats import chi2

from board_scene import CAMERA, CHESSBOARD, apart, photograph_of, seen_boards, squared_deviations, tilted_poses
from glisson.core import BadInput, StageFailed, Status
from glisson.intraoperative.cameras.board_detection import find_board
from glisson.intraoperative.cameras.board_pose import board_pose
from glisson.intraoperative.cameras.boards import Board, BoardView, board_from_text
from glisson.intraoperative.cameras.calibration import calibrate_camera

CHARUCO = Board("charuco", 10, 7, 5.0, 3.7, "4X4_50")
BOARDS = [CHESSBOARD, CHARUCO, Board("dots", 8, 7, 5.0), Board("asymmetric-dots", 4, 9, 4.0)]


def calibrated(seed, count=12, tilt_deg=(15.0, 45.0)):
    rng = np.random.default_rng(seed)
    poses = tilted_poses(rng, count, tilt_deg)
    return calibrate_camera(seen_boards(rng, poses), CAMERA.width, CAMERA.height), poses


def test_regions_of_ninety_percent_hold_what_they_should(capfd):
    """Of 200 calibrations 87 to 93 % have focal lengths and centre in their 90 % region; of the poses likewise."""
    inside, poses_inside, errors = [], [], []
    for seed in range(200):
        found, poses = calibrated(seed)
        off = np.concatenate([found.camera.focal_px - CAMERA.focal_px, found.camera.centre_px - CAMERA.centre_px])
        inside.append(squared_deviations(off, found.camera.covariance[:4, :4]) < chi2.ppf(0.9, 4))
        errors.append(np.abs(off))
        poses_inside += [
            squared_deviations(apart(one, true), one.covariance) < chi2.ppf(0.9, 6)
            for one, true in zip(found.camera_from_board, poses, strict=True)
        ]
    with capfd.disabled():
        print(f"\ncamera: held {np.mean(inside):.3f}, poses {np.mean(poses_inside):.3f}, "
              f"median error {np.median(errors, axis=0).round(2)} px")  # fmt: skip
    assert 0.87 <= np.mean(inside) <= 0.93
    assert 0.87 <= np.mean(poses_inside) <= 0.93


def test_the_adjustment_is_opencv_s_where_both_estimate_the_same():
    rng = np.random.default_rng(1)
    views = seen_boards(rng, tilted_poses(rng, 10))
    found = calibrate_camera(views, CAMERA.width, CAMERA.height)
    assert found.terms[:4] == ("k1", "k2", "p1", "p2")
    points, pixels = ([getattr(view, name).astype(np.float32) for view in views] for name in ("points_mm", "pixels"))
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-14)
    rms, matrix, distortion, *_ = cv2.calibrateCamera(
        points,
        pixels,
        (1440, 1080),
        None,
        None,
        flags=0 if "k3" in found.terms else cv2.CALIB_FIX_K3,
        criteria=criteria,
    )
    assert found.rms_px == pytest.approx(rms, rel=1e-5)
    assert found.camera.focal_px == pytest.approx(matrix[[0, 1], [0, 1]], abs=0.05)
    assert found.camera.centre_px == pytest.approx(matrix[:2, 2], abs=0.05)
    assert found.camera.distortion == pytest.approx(distortion.ravel(), abs=1e-4)


def test_boards_parallel_to_the_image_leave_the_focal_length_open():
    for seed in range(10):
        with pytest.raises(StageFailed, match="nearly parallel to the image") as refused:
            calibrated(seed, 10, (0.0, 1.0))
        assert refused.value.status is Status.UNOBSERVABLE


def test_a_view_that_is_repeated_is_none():
    rng = np.random.default_rng(4)
    poses = tilted_poses(rng, 5)
    views = seen_boards(rng, [*poses, poses[1], poses[3]])
    with pytest.raises(BadInput, match=r"again in view 6 \(as view 2\), view 7 \(as view 4\)"):
        calibrate_camera(views, CAMERA.width, CAMERA.height)


def test_points_of_something_else_are_left_out_and_told():
    rng = np.random.default_rng(3)
    views = seen_boards(rng, tilted_poses(rng, 12))
    pixels = np.array(views[4].pixels)
    pixels[:3] += [40.0, -25.0]
    views[4] = BoardView("view 5", views[4].points_mm, pixels)
    found = calibrate_camera(views, CAMERA.width, CAMERA.height)
    assert (~found.used[4]).nonzero()[0].tolist() == [0, 1, 2]
    assert all(one.all() for number, one in enumerate(found.used) if number != 4)
    assert any("view 5: 3 of 54" in note for note in found.notes)
    assert np.abs(found.camera.focal_px - CAMERA.focal_px).max() < 8.0


def test_small_boards_in_the_middle_are_told():
    rng = np.random.default_rng(4)
    poses = [pose for pose in tilted_poses(rng, 200) if np.abs(pose.apply(CHESSBOARD.points_mm)[:, :2]).max() < 27.0]
    found = calibrate_camera(seen_boards(rng, poses[:8]), CAMERA.width, CAMERA.height)
    assert any("% of the image" in note for note in found.notes)


@pytest.mark.parametrize("board", BOARDS, ids=lambda board: board.kind)
def test_points_of_a_rendered_board(board):
    rng = np.random.default_rng(6)
    for pose in tilted_poses(rng, 2, (10.0, 35.0), board):
        image, pixels = photograph_of(board, pose, rng)
        view = find_board(image, board, "rendered")
        assert view is not None
        assert len(view.pixels) >= 0.9 * len(board.points_mm)
        found = view.pixels
        pixels = pixels[np.linalg.norm(view.points_mm[:, None] - board.points_mm[None], axis=2).argmin(axis=1)]
        if board.looks_the_same_upside_down and np.linalg.norm(found[0] - pixels[0]) > 20.0:
            found = found[::-1]
        # Centres of ellipses are not quite those of the dots.
        assert np.sqrt(((found - pixels) ** 2).sum(axis=1).mean()) < (0.3 if "dots" in board.kind else 0.1)


def test_a_mirrored_image_is_refused_and_an_empty_one_has_no_board():
    rng = np.random.default_rng(7)
    image, _ = photograph_of(CHARUCO, tilted_poses(rng, 1, (10.0, 20.0), CHARUCO)[0], rng)
    with pytest.raises(BadInput, match="mirrored"):
        find_board(np.ascontiguousarray(image[:, ::-1]), CHARUCO, "mirrored")
    for board in BOARDS:
        assert find_board(np.full((200, 300, 3), 128, dtype=np.uint8), board, "empty") is None


def test_a_far_board_that_two_poses_explain_is_ambiguous():
    rng = np.random.default_rng(8)
    near = tilted_poses(rng, 1, (30.0, 31.0))[0]
    far = type(near)("camera", "board", near.rotation, [10.0, 5.0, 3000.0])
    with pytest.raises(StageFailed, match="two poses") as refused:
        board_pose(CAMERA, seen_boards(rng, [far])[0])
    assert refused.value.status is Status.AMBIGUOUS


@pytest.mark.parametrize(
    ("text", "sentence"),
    [("chessboard:9x6", "A board is written"), ("chess:9x6:5", "A board is written"), ("dots:9xsix:5", "is written"),
     ("dots:9x2:5", "at least 3"), ("dots:9x6:-5", "positive"), ("charuco:9x6:5:6:4X4_50", "smaller")],
)  # fmt: skip
def test_boards_that_are_none(text, sentence):
    with pytest.raises(BadInput, match=sentence):
        board_from_text(text)


def test_views_that_cannot_be_used():
    rng = np.random.default_rng(9)
    views = seen_boards(rng, tilted_poses(rng, 3))
    with pytest.raises(BadInput, match="too few"):
        calibrate_camera(views[:2], 1440, 1080)
    with pytest.raises(BadInput, match="outside the image"):
        calibrate_camera(views, 640, 480)
    with pytest.raises(BadInput, match="one line"):
        BoardView("flat", CHESSBOARD.points_mm[:9], views[0].pixels[:9])
    with pytest.raises(BadInput, match="not finite"):
        BoardView("nan", CHESSBOARD.points_mm, np.full((54, 2), np.nan))
