"""Coloured crosses of known place on the walls and the ceiling of a room, by which a camera finds its own."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.marker_colours import MARKER_COLOURS
from glisson.core.transform import RigidTransform

_ARM, _END = 1.0 / 6.0, 0.5
_CORNERS = np.array(
    [
        [_END, -_ARM], [_END, _ARM], [_ARM, _ARM],
        [_ARM, _END], [-_ARM, _END], [-_ARM, _ARM],
        [-_END, _ARM], [-_END, -_ARM], [-_ARM, -_ARM],
        [-_ARM, -_END], [_ARM, -_END], [_ARM, -_ARM],
    ]
)  # fmt: skip
_SQUARES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]]) / 3.0
BOARD_SHARE = 4.0 / 3.0
"""Side of the white sheet in sizes of the cross that is printed on it."""


@dataclass(frozen=True, eq=False)
class Cross:
    """Five squares of paper in colour on a white sheet.

    The frame "cross" has its origin in the middle of the cross, x to the right and y down as one looks at it, and z
    into the wall (mm).

    Args:
        name: as people call it.
        colours: of the square in the middle and of the arms to the right, below, to the left and above.
        size_mm: from the end of an arm to that of the opposite one; an arm is a third as wide.
        room_from_cross: where it hangs; with covariance, where that was measured.
    """

    name: str
    colours: tuple[str, ...]
    size_mm: float
    room_from_cross: RigidTransform

    def __post_init__(self) -> None:
        if len(self.colours) != 5 or not set(self.colours) <= set(MARKER_COLOURS):
            raise BadInput(f"The cross {self.name!r} needs five colours out of {', '.join(MARKER_COLOURS)}.")
        if not (np.isfinite(self.size_mm) and self.size_mm > 0.0):
            raise BadInput(f"The cross {self.name!r} needs a positive size, not {self.size_mm} mm.")
        if (self.room_from_cross.target, self.room_from_cross.source) != ("room", "cross"):
            raise BadInput(f"The cross {self.name!r} needs a pose from the frame cross to the frame room.")

    @property
    def corners_mm(self) -> FloatArray:
        """Its twelve corners (12, 3) in the room, clockwise, from the upper one at the end of the right arm."""
        return self.in_room(_CORNERS * self.size_mm)

    def in_room(self, points_mm: FloatArray) -> FloatArray:
        """Points (n, 2) of the paper as (n, 3) in the room."""
        flat = np.column_stack([points_mm, np.zeros(len(points_mm))])
        return self.room_from_cross.apply(flat)


@dataclass(frozen=True, eq=False)
class CrossLayout:
    """The crosses of a room; no two may be mistaken for each other, nor one for its mirror image.

    Raises:
        BadInput: there is none, names or colours are there twice, or a cross has no handedness.
    """

    crosses: tuple[Cross, ...]

    def __post_init__(self) -> None:
        if not self.crosses:
            raise BadInput("A layout needs at least one cross.")
        if len({cross.name for cross in self.crosses}) < len(self.crosses):
            raise BadInput("Two crosses of the layout have the same name.")
        for cross in self.crosses:
            turned = readings(cross.colours)
            if cross.colours in turned[1:] or set(turned) & set(readings(cross.colours, mirrored=True)):
                raise BadInput(f"The cross {cross.name!r} looks the same when it is turned or mirrored.")
        for one, other in combinations(self.crosses, 2):
            if one.colours in readings(other.colours) + readings(other.colours, mirrored=True):
                raise BadInput(f"The crosses {one.name!r} and {other.name!r} look the same, turned or mirrored.")

    def __len__(self) -> int:
        return len(self.crosses)


def unit_corners() -> FloatArray:
    """The corners (12, 2) of a cross of size 1, in the order of `Cross.corners_mm`."""
    return _CORNERS.copy()


def unit_squares() -> FloatArray:
    """Middles (5, 2) of the squares of a cross of size 1, in the order of its colours."""
    return _SQUARES.copy()


def readings(colours: tuple[str, ...], *, mirrored: bool = False) -> list[tuple[str, ...]]:
    """The four orders in which the colours may be read, clockwise from any arm; as in a mirror if so asked."""
    middle, *arms = colours
    if mirrored:
        arms = [arms[0], *arms[:0:-1]]
    return [(middle, *arms[turn:], *arms[:turn]) for turn in range(4)]
