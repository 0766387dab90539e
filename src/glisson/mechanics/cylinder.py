"""A rigid bar with round ends."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.tools import Cylinder
from glisson.mechanics.carried_tool import CarriedTool


class CylinderTool(CarriedTool):
    """All within a radius of a line between two points."""

    def __init__(self, cylinder: Cylinder, moves: bool = False) -> None:
        super().__init__(cylinder.name, cylinder.radius_mm, moves)
        self._radius = cylinder.radius_mm
        self._start, self._line = cylinder.start_mm, cylinder.end_mm - cylinder.start_mm

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance to the line, less the radius."""
        outward, _ = self._outward(points)
        result: FloatArray = np.linalg.norm(outward, axis=1) - self._radius
        return result

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Normals point away from the line; across it the surface curves, and at the ends along it too."""
        outward, ended = self._outward(points)
        reach = np.maximum(np.linalg.norm(outward, axis=1), 1e-300)
        normals = outward / reach[:, None]
        along = self._line / np.linalg.norm(self._line)
        flat = np.eye(3) - np.where(ended, 0.0, 1.0)[:, None, None] * np.outer(along, along)
        hessians = (flat - normals[:, :, None] * normals[:, None, :]) / reach[:, None, None]
        return normals, hessians

    def _outward(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """From the nearest place of the line (n, 3), and whether that is an end (n,)."""
        away = points - self._start
        share = away @ self._line / float(self._line @ self._line)
        within = np.clip(share, 0.0, 1.0)
        return away - within[:, None] * self._line, share != within
