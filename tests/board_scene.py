"""Boards before a camera: where their points are seen, images of them, and what a tracker would say. Exact truth."""

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.camera import Camera
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.boards import Board, BoardView
from glisson.intraoperative.cameras.hand_eye_equations import HandEyeView
from glisson.phantom.optics import seen_at, sensor_slopes
from glisson.phantom.photograph import Sensor, averaged, photographed

CAMERA = Camera(1440, 1080, [1100.0, 1105.0], [715.0, 548.0], [-0.21, 0.07, 1e-3, -8e-4, 0.0])
CHESSBOARD = Board("chessboard", 9, 6, 5.0)
CAMERA_FROM_MARKER = RigidTransform(
    "camera", "marker", Rotation.from_rotvec([0.4, 0.3, -1.6]).as_matrix(), [25.0, 140.0, -350.0]
)
BASE_FROM_BOARD = RigidTransform("base", "board", Rotation.from_rotvec([0.2, -2.0, -0.5]).as_matrix(), [-11.0, 2, -20])


def tilted_poses(rng, count, tilt_deg=(15.0, 45.0), board=CHESSBOARD, camera=CAMERA):
    """`camera_from_board` of boards that are wholly in the image."""
    middle = board.points_mm.mean(axis=0)
    size = np.ptp(board.points_mm, axis=0).max()
    poses = []
    while len(poses) < count:
        about, tilt = rng.uniform(0.0, 2.0 * np.pi), np.radians(rng.uniform(*tilt_deg))
        turn = Rotation.from_rotvec([tilt * np.cos(about), tilt * np.sin(about), 0.0])
        turn = (turn * Rotation.from_rotvec([0.0, 0.0, rng.uniform(-np.pi, np.pi)])).as_matrix()
        depth = size * rng.uniform(1.25, 2.5)
        centre = depth * np.array([rng.uniform(-0.4, 0.4), rng.uniform(-0.3, 0.3), 1.0])
        pose = RigidTransform("camera", "board", turn, centre - turn @ middle)
        pixels = seen_at(camera, pose.apply(board.points_mm))
        if (pixels > 20).all() and (pixels < [camera.width - 20, camera.height - 20]).all():
            poses.append(pose)
    return poses


def seen_boards(rng, poses, sigma_px=0.3, board=CHESSBOARD, camera=CAMERA):
    """Views with normal errors in each coordinate of a pixel."""
    views = []
    for number, pose in enumerate(poses):
        pixels = seen_at(camera, pose.apply(board.points_mm))
        views.append(
            BoardView(f"view {number + 1}", board.points_mm, pixels + sigma_px * rng.normal(size=pixels.shape))
        )
    return views


def tracked_boards(rng, poses, sigma_rad, sigma_mm, with_base):
    """Views with tracked poses of the camera's marker, and of the board's if `with_base`."""
    views = []
    for seen, pose in zip(seen_boards(rng, poses), poses, strict=True):
        base_from_marker = BASE_FROM_BOARD.after(pose.inverse()).after(CAMERA_FROM_MARKER)
        turn = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix() if with_base else np.eye(3)
        base = RigidTransform("room", "base", turn, 100.0 * rng.normal(size=3) if with_base else np.zeros(3))
        marker = shaken(rng, base.after(base_from_marker), sigma_rad, sigma_mm)
        views.append(HandEyeView(seen, marker, shaken(rng, base, sigma_rad, sigma_mm) if with_base else None))
    return views


def shaken(rng, pose, sigma_rad, sigma_mm):
    """A pose with a tracker's errors."""
    turn = Rotation.from_rotvec(sigma_rad * rng.normal(size=3)).as_matrix() @ pose.rotation
    return RigidTransform(pose.target, pose.source, turn, pose.translation_mm + sigma_mm * rng.normal(size=3))


def apart(found, true):
    """d and e (6,) from a true pose to the found one."""
    turn = Rotation.from_matrix(found.rotation @ true.rotation.T).as_rotvec()
    return np.concatenate([turn, found.translation_mm - true.translation_mm])


def squared_deviations(error, covariance):
    """Squared Mahalanobis distance, chi-squared with as many degrees of freedom as there are errors."""
    return float(error @ np.linalg.solve(covariance, error))


def printed(board, px_per_mm):
    """The board as printed, [row, column] in 0 to 1, and the pixel of its frame's origin."""
    step = board.spacing_mm * px_per_mm
    if board.kind == "charuco":
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{board.dictionary}"))
        size = (board.columns, board.rows)
        drawn = cv2.aruco.CharucoBoard(size, board.spacing_mm, board.marker_mm, dictionary).generateImage(
            (int(size[0] * step), int(size[1] * step))
        )
        return np.pad(drawn / 255.0, int(step), constant_values=1.0), step + np.array([-0.5, -0.5])
    if board.kind == "chessboard":
        rows, columns = np.indices((board.rows + 1, board.columns + 1))
        squares = np.where((rows + columns) % 2 == 0, 1.0, 0.0)
        squares = 1.0 - squares if squares[1, 1] == 1.0 else squares  # black behind the first four corners
        drawn = np.kron(squares, np.ones((int(step), int(step))))
        return np.pad(drawn, int(step), constant_values=1.0), 2.0 * step + np.array([-0.5, -0.5])
    margin = 3.0 * step
    points = board.points_mm[:, :2] * px_per_mm + margin
    down, across = np.indices(np.ceil(points.max(axis=0) + margin).astype(int)[::-1])
    drawn = np.ones(down.shape)
    for u, v in points:
        drawn[(across - u) ** 2 + (down - v) ** 2 < (0.3 * step) ** 2] = 0.0
    return drawn, np.array([margin, margin])


def photograph_of(board, pose, rng, camera=CAMERA, samples=1, px_per_mm=12):
    """An image of a board, and its points' true pixels."""
    drawn, origin = printed(board, px_per_mm)
    slopes = sensor_slopes(camera, samples)
    rays = np.concatenate([slopes, np.ones((*slopes.shape[:2], 1))], axis=2)
    depth = (pose.translation_mm @ pose.rotation[:, 2]) / (rays @ pose.rotation[:, 2])
    on_board = (rays * depth[:, :, None] - pose.translation_mm) @ pose.rotation
    maps = (on_board[:, :, :2] * px_per_mm + origin).astype(np.float32)
    light = cv2.remap(drawn.astype(np.float32), maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderValue=0.6)
    light = averaged(np.repeat(0.1 + 0.7 * light[:, :, None].astype(float), 3, axis=2), samples)
    return photographed(light, Sensor(), rng), seen_at(camera, pose.apply(board.points_mm))
