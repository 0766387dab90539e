"""Finds the points of a calibration board in an image, to a fraction of a pixel."""

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.intraoperative.cameras.boards import Board, BoardView

_LEAST_POINTS = 6


def find_board(image: NDArray[np.uint8], board: Board, name: str) -> BoardView | None:
    """The board's points in an image (h, w, 3), or None where the board is not found.

    The centres of round dots are those of their ellipses, which perspective shifts a little outwards.

    Args:
        image: red, green, blue.
        board: what to look for. Chessboards and dots must be seen whole, of a ChArUco board some squares are enough.
        name: what the view is called.

    Raises:
        BadInput: the image is mirrored, or there is no such ArUco dictionary.
    """
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2GRAY), dtype=np.uint8)
    if board.kind == "charuco":
        return _charuco(grey, board, name)
    pixels = _corners(grey, board) if board.kind == "chessboard" else _dots(grey, board)
    return None if pixels is None else BoardView(name, board.points_mm, pixels)


def _corners(grey: NDArray[np.uint8], board: Board) -> FloatArray | None:
    size = (board.columns, board.rows)
    found, corners = cv2.findChessboardCornersSB(grey, size, flags=cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY)
    if not found:
        found, corners = cv2.findChessboardCorners(grey, size)
        if not found:
            return None
        spacing = np.linalg.norm(np.diff(corners.reshape(board.rows, board.columns, 2), axis=1), axis=2).min()
        reach = max(2, int(spacing / 3))
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-4)
        corners = cv2.cornerSubPix(grey, corners, (reach, reach), (-1, -1), criteria)
    return _first_square_black(grey, corners.reshape(board.rows, board.columns, 2).astype(np.float64))


def _first_square_black(grey: NDArray[np.uint8], grid: FloatArray) -> FloatArray:
    """The corners (n, 2) in the order in which the square between the first four is black.

    Detectors number the corners from either end. Half a turn changes the colour of the first square, unless columns
    and rows are both odd or both even.
    """
    middles = (grid[:-1, :-1] + grid[:-1, 1:] + grid[1:, :-1] + grid[1:, 1:]) / 4.0
    column, row = np.rint(middles).astype(int).reshape(-1, 2).T
    shades = grey[row, column].reshape(middles.shape[:2]).astype(np.float64)
    like_the_first = np.indices(shades.shape).sum(axis=0) % 2 == 0
    ordered = grid if shades[like_the_first].mean() < shades[~like_the_first].mean() else grid[::-1, ::-1]
    return ordered.reshape(-1, 2)


def _dots(grey: NDArray[np.uint8], board: Board) -> FloatArray | None:
    kind = cv2.CALIB_CB_SYMMETRIC_GRID if board.kind == "dots" else cv2.CALIB_CB_ASYMMETRIC_GRID
    detector = cv2.SimpleBlobDetector.create(_round_blobs(grey.size))
    for shown in (grey, np.subtract(255, grey)):  # dark dots, then bright ones
        for way in (cv2.CALIB_CB_CLUSTERING, 0):  # the second bears more that is no dot
            size = (board.columns, board.rows)
            found, centres = cv2.findCirclesGrid(shown, size, flags=kind | way, blobDetector=detector)
            if found:
                return _seen_from_the_front(np.asarray(centres.reshape(-1, 2), dtype=np.float64), board)
    return None


def _seen_from_the_front(pixels: FloatArray, board: Board) -> FloatArray:
    """The dots in an order in which columns run clockwise of rows, as they do for who looks at the print."""
    flat, _ = cv2.findHomography(board.points_mm[:, :2], pixels)
    if np.linalg.det(flat[:2, :2]) > 0.0:
        return pixels
    return pixels.reshape(board.rows, board.columns, 2)[:, ::-1].reshape(-1, 2)


def _round_blobs(pixels: int) -> cv2.SimpleBlobDetector.Params:
    wanted = cv2.SimpleBlobDetector.Params()
    wanted.minArea, wanted.maxArea = 12.0, pixels / 50.0
    wanted.minDistBetweenBlobs = 3.0
    return wanted


def _charuco(grey: NDArray[np.uint8], board: Board, name: str) -> BoardView | None:
    view = _charuco_view(grey, board, name)
    if view is None and _charuco_view(np.ascontiguousarray(grey[:, ::-1]), board, name) is not None:
        raise BadInput(f"{name}: the image is mirrored; the board is found only in its mirror image.")
    return view


def _charuco_view(grey: NDArray[np.uint8], board: Board, name: str) -> BoardView | None:
    """By the layout with which more corners are found: OpenCV 4.6 changed on which squares the first marker sits."""
    number = getattr(cv2.aruco, f"DICT_{board.dictionary}", None)
    if number is None:
        raise BadInput(f"OpenCV has no ArUco dictionary {board.dictionary!r}; 4X4_50 and 6X6_250 are two that it has.")
    best: BoardView | None = None
    for older in (False, True):
        size = (board.columns, board.rows)
        dictionary = cv2.aruco.getPredefinedDictionary(number)
        printed = cv2.aruco.CharucoBoard(size, board.spacing_mm, board.marker_mm, dictionary)
        printed.setLegacyPattern(older)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(printed).detectBoard(grey)
        if ids is None or len(ids) < max(_LEAST_POINTS, 0 if best is None else len(best.pixels) + 1):
            continue
        points = board.points_mm[ids.ravel()]
        if np.linalg.matrix_rank(points[:, :2] - points[:, :2].mean(axis=0)) == 2:
            best = BoardView(name, points, np.asarray(corners.reshape(-1, 2), dtype=np.float64))
    return best
