"""The board: a half-space, perhaps with a slot through it."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.tools import Board, Slot


class BoardTool:
    """The organ is on the side of the normal. The frame has the patient's axes and starts at the board's point."""

    def __init__(self, board: Board) -> None:
        self.name = board.name
        self.yields = board.conforming
        self.moves = False
        self.edge_radius_mm = None if board.slot is None else board.slot.edge_radius_mm
        self._board = board
        self._slot = None if board.slot is None else _Opening(board, board.slot)

    def pose(self, angle: float) -> tuple[FloatArray, FloatArray]:
        """A board does not move."""
        return np.eye(3), self._board.point_mm

    def distance(self, points: FloatArray) -> FloatArray:
        """Height over the board; over the slot the distance to its rim."""
        height: FloatArray = points @ self._board.normal
        return height if self._slot is None else self._slot.distance(points, height)

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A plane has no curvature; the slot's rounded rim has some."""
        normals, hessians = np.tile(self._board.normal, (len(points), 1)), np.zeros((len(points), 3, 3))
        if self._slot is not None:
            self._slot.amend(points, points @ self._board.normal, normals, hessians)
        return normals, hessians


class _Opening:
    """A slot's distance: that to the board shrunk by the rim's radius, less the radius."""

    def __init__(self, board: Board, slot: Slot) -> None:
        self._radius = slot.edge_radius_mm
        self._normal = board.normal
        self._centre = slot.centre_mm - board.point_mm
        self._axes = np.stack([slot.along, np.cross(board.normal, slot.along)])
        self._half = 0.5 * np.array([slot.length_mm, slot.width_mm]) + self._radius

    def distance(self, points: FloatArray, height: FloatArray) -> FloatArray:
        """Signed distance (n,) of points (n, 3) at heights (n,) over the board's face."""
        above, inward = height + self._radius, self._inward(points)
        least = inward.min(axis=1)
        sunk = np.linalg.norm(np.maximum(-inward, 0.0), axis=1)  # how far beside the opening
        beside = np.where(above > 0.0, above, -np.minimum(-above, sunk))
        over = np.where(above > 0.0, np.hypot(above, least), least)
        result: FloatArray = np.where(least > 0.0, over, beside) - self._radius
        return result

    def amend(self, points: FloatArray, height: FloatArray, normals: FloatArray, hessians: FloatArray) -> None:
        """Put in gradient and Hessian of points over the slot, or in the board beside it."""
        above, inward = height + self._radius, self._inward(points)
        least, axis = inward.min(axis=1), inward.argmin(axis=1)
        sides = -np.sign(self._places(points))
        walls = np.take_along_axis(sides, axis[:, None], axis=1) * self._axes[axis]  # away from the nearest wall
        inside = least > 0.0
        normals[inside] = walls[inside]
        rim = np.flatnonzero(inside & (above > 0.0))
        reach = np.hypot(above[rim], least[rim])
        upward, wall = np.tile(self._normal, (len(rim), 1)), walls[rim]
        radial = (above[rim, None] * upward + least[rim, None] * wall) / reach[:, None]
        normals[rim] = radial
        round_plane = _outer(upward) + _outer(wall) - _outer(radial)
        hessians[rim] = round_plane / reach[:, None, None]
        out = np.maximum(-inward, 0.0)
        sunk = np.linalg.norm(out, axis=1)
        deep = ~inside & (above <= 0.0) & (sunk < -above)
        normals[deep] = ((sides * out)[deep] / np.maximum(sunk[deep], 1e-300)[:, None]) @ self._axes

    def _places(self, points: FloatArray) -> FloatArray:
        """Along and across the slot from its centre (n, 2)."""
        places: FloatArray = (points - self._centre) @ self._axes.T
        return places

    def _inward(self, points: FloatArray) -> FloatArray:
        """How far inside the shrunk board's opening (n, 2), along and across."""
        inward: FloatArray = self._half - np.abs(self._places(points))
        return inward


def _outer(vectors: FloatArray) -> FloatArray:
    result: FloatArray = vectors[:, :, None] * vectors[:, None, :]
    return result
