"""Wheels, crosses and calibration boards as sheets to print at true scale."""

import cv2
import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.crosses import Cross, unit_squares
from glisson.core.errors import BadInput
from glisson.core.instruments import RINGS, SECTORS, Instrument
from glisson.intraoperative.cameras.boards import Board
from glisson.io.true_scale_pdf import Area, Sheet

INKS = {
    "red": (0.85, 0.05, 0.10), "yellow": (1.0, 0.86, 0.0), "green": (0.0, 0.60, 0.25), "blue": (0.05, 0.25, 0.80),
}  # fmt: skip
"""What is asked of the printer; any red, yellow, green and blue of these hues do."""

_WHITE, _BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
_PLACES = ("in the middle", "on the right", "below", "on the left", "above")
_LARGEST_WHOLE_MM = 270.0
_STEPS = 720
"""Corners of a circle: a polygon of so many is a thousandth of a percent smaller."""


def wheel_sheet(instrument: Instrument) -> Sheet:
    """The wheel of an instrument, its face to the reader; the black middle is cut out for the shaft."""
    radius = 0.5 * instrument.wheel_mm
    wide = 2.0 * np.pi / SECTORS
    sectors = [
        Area(_ring(RINGS.inner * radius, RINGS.outer * radius, k * wide, (k + 1) * wide), INKS[colour])
        for k, colour in enumerate(instrument.colours)
    ]
    discs = [Area(_disc(share * radius), colour) for share, colour in ((1.0, _BLACK), (RINGS.white, _WHITE))]
    hole = Area(_disc(RINGS.hole * radius), _BLACK)
    title = f"{instrument.name}: wheel of {instrument.wheel_mm:g} mm, {instrument.length_mm:g} mm from the tip"
    words = "Cut out the disc along its outer edge, and its black middle for the shaft; its face looks to the tip."
    return Sheet(title, (*discs, *sectors, hole), ((0.0, -radius - 8.0, words),))


def cross_sheets(cross: Cross) -> tuple[Sheet, ...]:
    """A cross of a layout, upright as one looks at it: one sheet, or one for each square where it is larger than A3."""
    squares = [
        Area(cross.size_mm * (middle + _square(1.0 / 3.0)), INKS[colour])
        for middle, colour in zip(unit_squares() * [1.0, -1.0], cross.colours, strict=True)
    ]
    title = f"{cross.name}: cross of {cross.size_mm:g} mm, this side up"
    if cross.size_mm <= _LARGEST_WHOLE_MM:
        return (Sheet(title, tuple(squares)),)
    return tuple(
        Sheet(
            f"{title}, the square {place}", (Area(square.corners_mm - square.corners_mm.mean(axis=0), square.colour),)
        )
        for place, square in zip(_PLACES, squares, strict=True)
    )


def board_sheet(board: Board) -> Sheet:
    """A calibration board, its first point in the upper left corner.

    Raises:
        BadInput: an unknown ArUco dictionary, or one with too few markers.
    """
    kinds = {"chessboard": _chessboard, "charuco": _charuco}
    areas = kinds[board.kind](board) if board.kind in kinds else _dots(board)
    corners = np.concatenate([corners for corners, _ in areas])
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    # The board's y is down, a sheet's is up.
    upright = tuple(Area((corners - middle) * [1.0, -1.0], colour) for corners, colour in areas)
    return Sheet(f"{board.kind} {board.columns} × {board.rows}, {board.spacing_mm:g} mm", upright)


_Painted = tuple[FloatArray, tuple[float, float, float]]


def _chessboard(board: Board) -> list[_Painted]:
    """Squares about the inner corners; the one between the first four corners is black."""
    step = board.spacing_mm
    places = [(c, r) for r in range(-1, board.rows) for c in range(-1, board.columns) if (c + r) % 2 == 0]
    return [(step * (np.array(place) + 0.5 + _square(1.0)), _BLACK) for place in places]


def _dots(board: Board) -> list[_Painted]:
    disc = _disc(0.3 * board.spacing_mm)
    return [(point[:2] + disc, _BLACK) for point in board.points_mm]


def _charuco(board: Board) -> list[_Painted]:
    number = getattr(cv2.aruco, f"DICT_{board.dictionary}", None)
    if number is None:
        raise BadInput(f"There is no ArUco dictionary {board.dictionary!r}; 4X4_250 is one.")
    dictionary = cv2.aruco.getPredefinedDictionary(number)
    size, step = (board.columns, board.rows), board.spacing_mm
    if board.columns * board.rows // 2 > len(dictionary.bytesList):
        raise BadInput(
            f"The ArUco dictionary {board.dictionary} has too few markers for {size[0]} × {size[1]} squares."
        )
    made = cv2.aruco.CharucoBoard(size, step, board.marker_mm, dictionary)
    corners = [np.asarray(entry, dtype=np.float64).reshape(4, 3)[:, :2] for entry in made.getObjPoints()]
    white = {(int(column), int(row)) for column, row in (entry.mean(axis=0) // step for entry in corners)}
    places = [(c, r) for r in range(board.rows) for c in range(board.columns) if (c, r) not in white]
    painted: list[_Painted] = [(step * (np.array(place) + 0.5 + _square(1.0)), _BLACK) for place in places]
    for entry, identity in zip(corners, np.ravel(made.getIds()), strict=True):
        painted += _marker(entry, dictionary, int(identity))
    return painted


def _marker(corners: FloatArray, dictionary: "cv2.aruco.Dictionary", identity: int) -> list[_Painted]:
    """A black square (corners (4, 2) from the upper left one, clockwise) with white cells."""
    cells = dictionary.markerSize + 2
    picture = np.asarray(dictionary.generateImageMarker(identity, cells, borderBits=1))
    right, down = (corners[1] - corners[0]) / cells, (corners[3] - corners[0]) / cells
    painted: list[_Painted] = [(corners, _BLACK)]
    for row, column in np.argwhere(picture > 0):
        first = corners[0] + column * right + row * down
        painted.append((np.array([first, first + right, first + right + down, first + down]), _WHITE))
    return painted


def _square(side: float) -> FloatArray:
    return 0.5 * side * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def _disc(radius: float) -> FloatArray:
    angles = np.arange(_STEPS) * 2.0 * np.pi / _STEPS
    return radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _ring(inner: float, outer: float, begin: float, end: float) -> FloatArray:
    angles = np.linspace(begin, end, _STEPS // SECTORS + 1)
    arc = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.concatenate([outer * arc, inner * arc[::-1]])
