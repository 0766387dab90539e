"""A rigid bar with round ends."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.tools import Cylinder
from glisson.geometry.compiled import compiled
from glisson.mechanics.carried_tool import CarriedTool


class CylinderTool(CarriedTool):
    """All within a radius of a line between two points."""

    def __init__(self, cylinder: Cylinder, moves: bool = False) -> None:
        super().__init__(cylinder.name, cylinder.radius_mm, moves)
        self._radius = cylinder.radius_mm
        self._start, self._line = cylinder.start_mm, cylinder.end_mm - cylinder.start_mm

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance to the line, less the radius."""
        return _distances(points, self._start, self._line) - self._radius

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Normals point away from the line; across it the surface curves, and at the ends along it too."""
        return _derivatives(points, self._start, self._line)


@compiled
def _outward(point: FloatArray, start: FloatArray, line: FloatArray, outward: FloatArray) -> tuple[float, float]:
    """Distance of a point (3,) from a line, and where on it, from 0 to 1, it would be nearest if that had no ends.

    `outward` (3,) is set to the way from the nearest place.
    """
    share, length, reach = 0.0, 0.0, 0.0
    for i in range(3):
        share += (point[i] - start[i]) * line[i]
        length += line[i] ** 2
    share /= length
    for i in range(3):
        outward[i] = point[i] - start[i] - min(max(share, 0.0), 1.0) * line[i]
        reach += outward[i] ** 2
    return np.sqrt(reach), share


@compiled
def _distances(points: FloatArray, start: FloatArray, line: FloatArray) -> FloatArray:
    distances, outward = np.zeros(len(points)), np.zeros(3)
    for n in range(len(points)):
        distances[n], _ = _outward(points[n], start, line, outward)
    return distances


@compiled
def _derivatives(points: FloatArray, start: FloatArray, line: FloatArray) -> tuple[FloatArray, FloatArray]:
    normals, hessians = np.zeros((len(points), 3)), np.zeros((len(points), 3, 3))
    along, outward = line / np.sqrt((line**2).sum()), np.zeros(3)
    for n in range(len(points)):
        distance, share = _outward(points[n], start, line, outward)
        reach, straight = max(distance, 1e-300), 1.0 if 0.0 <= share <= 1.0 else 0.0
        normals[n] = outward / reach
        for i in range(3):
            for j in range(3):
                flat = (1.0 if i == j else 0.0) - straight * along[i] * along[j]
                hessians[n, i, j] = (flat - normals[n, i] * normals[n, j]) / reach
    return normals, hessians
