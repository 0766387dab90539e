"""Calibration from files: boards in images, corner files and tracked poses in; `camera.toml` and poses out."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glisson.core.camera import Camera
from glisson.core.errors import BadInput, StageFailed
from glisson.core.protocols import Progress, silent
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.framework.calibration_picture import Shown, draw_residuals
from glisson.intraoperative.cameras.board_detection import find_board
from glisson.intraoperative.cameras.boards import Board, BoardView
from glisson.intraoperative.cameras.calibration import CameraCalibration, calibrate_camera
from glisson.intraoperative.cameras.hand_eye import HandEye, calibrate_hand_eye
from glisson.intraoperative.cameras.hand_eye_equations import HandEyeView
from glisson.io.camera_files import write_camera
from glisson.io.photographs import SUFFIXES, read_photograph
from glisson.io.pose_files import files_of, read_poses, write_pose
from glisson.io.tables import read_points

CAMERA = "camera.toml"
HAND_EYE = "hand-eye.toml"
HAND_EYE_CAMERA = "hand-eye-camera.toml"
BOARD = "board.toml"
CAMERA_PICTURE = "camera.png"
HAND_EYE_PICTURE = "hand-eye.png"


@dataclass(frozen=True, eq=False)
class BoardImages:
    """Views of a board from images or corner files.

    Args:
        views: those in which the board was found.
        numbers: which of the files, counted from 0, each view is.
        images: the image of each view [row, column, red green blue], None for corner files.
        count: of all files.
        size: (width, height) of the images in px, None where only corner files were given.
        not_found: names of images without a board.
    """

    views: tuple[BoardView, ...]
    numbers: tuple[int, ...]
    images: tuple[NDArray[np.uint8] | None, ...]
    count: int
    size: tuple[int, int] | None
    not_found: tuple[str, ...] = ()


def boards_in_images(paths: Sequence[str], board: Board, progress: Progress = silent) -> BoardImages:
    """Look for a board in images; a folder stands for the images in it.

    Raises:
        BadInput: an image cannot be read, is mirrored, or is of another size than the first.
        StageFailed: the board is in none of them.
    """
    files = files_of(paths, SUFFIXES)
    views, numbers, images, not_found = [], [], [], []
    size: tuple[int, int] | None = None
    for number, file in enumerate(files):
        progress(number / len(files), f"looking for the board in {file.name}")
        image = read_photograph(file)
        size = size or (image.shape[1], image.shape[0])
        if (image.shape[1], image.shape[0]) != size:
            raise BadInput(
                f"{file} has {image.shape[1]} × {image.shape[0]} px, the first image {size[0]} × {size[1]}; "
                "calibrate with images of one size."
            )
        view = find_board(image, board, file.name)
        if view is None:
            not_found.append(file.name)
            continue
        views.append(view)
        numbers.append(number)
        images.append(image)
    if not views:
        raise StageFailed(
            "The board was found in no image: are its columns, rows and dictionary right, and is it seen sharply?",
            Status.UNOBSERVABLE,
        )
    return BoardImages(tuple(views), tuple(numbers), tuple(images), len(files), size, tuple(not_found))


def boards_in_corner_files(corners: Sequence[str], points: Sequence[str]) -> BoardImages:
    """Views from text files of pixels (u v) and, in the same order, of board points in mm (x y z).

    Raises:
        BadInput: files that cannot be read or do not belong together.
    """
    if len(corners) != len(points):
        raise BadInput(f"{len(corners)} corner files need as many files of board points, not {len(points)}.")
    views = tuple(
        BoardView(Path(seen).name, read_points(on_board, 3), read_points(seen, 2))
        for seen, on_board in zip(corners, points, strict=True)
    )
    return BoardImages(views, tuple(range(len(views))), (None,) * len(views), len(views), None)


def camera_from_boards(boards: BoardImages, size: tuple[int, int] | None, folder: Path) -> CameraCalibration:
    """Calibrate a camera and write `camera.toml` and a picture of the residuals into a folder.

    Args:
        boards: the views.
        size: (width, height) of the images, needed where only corner files were given.
        folder: where the files go.

    Raises:
        BadInput: too few views, or no size.
        StageFailed: unobservable.
    """
    width, height = _size(boards, size)
    made = calibrate_camera(boards.views, width, height)
    write_camera(folder / CAMERA, made.camera)
    shown = [
        Shown(view.name, image, view.pixels, residuals, used)
        for view, image, residuals, used in zip(boards.views, boards.images, made.residuals_px, made.used, strict=True)
    ]
    draw_residuals(shown, (width, height), "Board points found, and computed from the camera", folder / CAMERA_PICTURE)
    return made


def hand_eye_from_boards(
    camera: Camera, boards: BoardImages, poses: Sequence[str], board_poses: Sequence[str], folder: Path
) -> HandEye:
    """Calibrate hand and eye; writes both poses, the corrected camera and a picture of the residuals into a folder.

    Args:
        camera: the calibrated camera.
        boards: the views.
        poses: files of the poses of the camera's marker, one for each image.
        board_poses: the same of the board's marker; none where the board rested.
        folder: where the files go.

    Raises:
        BadInput: poses that cannot be read, or not as many as images.
        StageFailed: unobservable or ambiguous.
    """
    if boards.size is not None and boards.size != (camera.width, camera.height):
        raise BadInput(
            f"The camera was calibrated at {camera.width} × {camera.height} px, the images have "
            f"{boards.size[0]} × {boards.size[1]} px."
        )
    of_marker = _paired(read_poses(poses, "room", "marker"), boards, "poses of the camera's marker")
    of_board: Sequence[RigidTransform | None] = [None] * len(of_marker)
    if board_poses:
        of_board = _paired(read_poses(board_poses, "room", "base"), boards, "poses of the board's marker")
    views = [HandEyeView(*one) for one in zip(boards.views, of_marker, of_board, strict=True)]
    made = calibrate_hand_eye(camera, views)
    write_pose(folder / HAND_EYE, made.camera_from_marker)
    write_pose(folder / BOARD, made.base_from_board)
    write_camera(folder / HAND_EYE_CAMERA, made.camera)
    shown = [
        Shown(view.name, image, view.pixels, residuals, np.ones(len(residuals), dtype=np.bool_))
        for view, image, residuals in zip(boards.views, boards.images, made.residuals_px, strict=True)
    ]
    draw_residuals(
        shown, (camera.width, camera.height), "Board points found, and computed from the tracked poses",
        folder / HAND_EYE_PICTURE,
    )  # fmt: skip
    return made


def _size(boards: BoardImages, size: tuple[int, int] | None) -> tuple[int, int]:
    if boards.size is not None and size is not None and boards.size != size:
        raise BadInput(f"The images have {boards.size[0]} × {boards.size[1]} px, not {size[0]} × {size[1]}.")
    found = boards.size or size
    if found is None:
        raise BadInput("Corner files do not say how large the images were; give --size, for example --size 1920x1080.")
    return found


def _paired(poses: Sequence[RigidTransform], boards: BoardImages, what: str) -> list[RigidTransform]:
    if len(poses) != boards.count:
        raise BadInput(f"{len(poses)} {what} cannot belong to {boards.count} images; give one for each.")
    return [poses[number] for number in boards.numbers]
