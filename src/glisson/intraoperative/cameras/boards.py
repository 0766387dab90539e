"""Calibration boards: flat patterns whose points are known."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput

BoardKind = Literal["chessboard", "dots", "asymmetric-dots", "charuco"]
_PLAIN_KINDS: dict[str, BoardKind] = {
    "chessboard": "chessboard",
    "dots": "dots",
    "asymmetric-dots": "asymmetric-dots",
}

_FORMS = (
    "chessboard:9x6:5 (inner corners, square in mm), dots:14x16:4, asymmetric-dots:4x11:5 (dots, spacing in mm) "
    "or charuco:19x26:5:4:4X4_250 (squares, square and marker in mm, ArUco dictionary)"
)


@dataclass(frozen=True)
class Board:
    """A flat board. Its frame "board" has x along rows of points, y along columns and z away from who looks at it.

    Args:
        kind: what is printed on it.
        columns: points in a row; squares for "charuco".
        rows: points in a column; squares for "charuco".
        spacing_mm: from one point to the next; in "asymmetric-dots" every other row is shifted by that much and a
            dot's neighbours in its own row are twice as far.
        marker_mm: side of the ArUco markers ("charuco").
        dictionary: of the ArUco markers, as OpenCV names it without DICT_ ("charuco").
    """

    kind: BoardKind
    columns: int
    rows: int
    spacing_mm: float
    marker_mm: float = 0.0
    dictionary: str = ""

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3:
            raise BadInput("A board needs at least 3 columns and 3 rows.")
        if not (np.isfinite(self.spacing_mm) and self.spacing_mm > 0.0):
            raise BadInput("A board's spacing must be a positive number of mm.")
        if self.kind == "charuco" and not 0.0 < self.marker_mm < self.spacing_mm:
            raise BadInput("The markers of a ChArUco board must be smaller than its squares.")

    @property
    def points_mm(self) -> FloatArray:
        """All points (n, 3), row by row; of a ChArUco board the corners where squares meet."""
        columns, rows = self.columns, self.rows
        if self.kind == "charuco":
            columns, rows = columns - 1, rows - 1
        row, column = np.divmod(np.arange(columns * rows), columns)
        across = 2 * column + row % 2 if self.kind == "asymmetric-dots" else column
        start = 1.0 if self.kind == "charuco" else 0.0
        return np.stack([across + start, row + start, np.zeros(len(row))], axis=1) * self.spacing_mm

    @property
    def looks_the_same_upside_down(self) -> bool:
        """Whether half a turn gives the same picture, so that nobody can tell which corner is the first."""
        if self.kind == "chessboard":
            return (self.columns + self.rows) % 2 == 0
        return self.kind == "dots" or (self.kind == "asymmetric-dots" and self.rows % 2 == 0)


def board_from_text(text: str) -> Board:
    """A board as it is written on the command line, such as "chessboard:9x6:5".

    Raises:
        BadInput: it is written otherwise, or there is no such board.
    """
    kind, _, rest = text.partition(":")
    size, *numbers = rest.split(":")
    wanted = 3 if kind == "charuco" else 1
    try:
        if wanted != len(numbers):
            raise ValueError
        columns, rows = (int(number) for number in size.split("x"))
        if kind == "charuco":
            return Board("charuco", columns, rows, float(numbers[0]), float(numbers[1]), numbers[2].upper())
        return Board(_PLAIN_KINDS[kind], columns, rows, float(numbers[0]))
    except (KeyError, ValueError):
        raise BadInput(f"A board is written {_FORMS}, not {text!r}.") from None


@dataclass(frozen=True, eq=False)
class BoardView:
    """Where points (n, 3) of a board, in mm, were seen in one image: pixels (n, 2).

    Raises:
        BadInput: fewer than 6 points, or numbers that do not belong together.
    """

    name: str
    points_mm: FloatArray
    pixels: FloatArray

    def __post_init__(self) -> None:
        points = frozen_floats(self.points_mm, (None, 3), f"{self.name}: the board's points")
        object.__setattr__(self, "points_mm", points)
        pixels = frozen_floats(self.pixels, (len(points), 2), f"{self.name}: the pixels of {len(points)} board points")
        object.__setattr__(self, "pixels", pixels)
        if len(points) < 6:
            raise BadInput(f"{self.name}: too few points of the board are seen ({len(points)}); at least 6 are needed.")
        if np.abs(points[:, 2]).max() > 0.0:
            raise BadInput(f"{self.name}: the board is not flat (z must be 0).")
        if np.linalg.matrix_rank(points[:, :2] - points[:, :2].mean(axis=0), tol=1e-6) < 2:
            raise BadInput(f"{self.name}: all points of the board lie on one line.")
