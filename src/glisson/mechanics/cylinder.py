"""A rigid cylinder without ends: a round bar that tissue is drawn over."""

import numpy as np

from glisson.core.arrays import FloatArray, unit_vector


class CylinderTool:
    """All points within `radius_mm` of the line through `point_mm` (3,) along `axis` (3,); it stands still."""

    def __init__(self, name: str, point_mm: FloatArray, axis: FloatArray, radius_mm: float) -> None:
        self.name = name
        self.yields = False
        self.moves = False
        self.radius_mm = radius_mm
        self._point = np.asarray(point_mm, dtype=np.float64)
        along = unit_vector(axis, "cylinder axis")
        self._across = np.eye(3) - np.outer(along, along)

    def pose(self, angle: float) -> tuple[FloatArray, FloatArray]:
        """Its frame has the patient's axes and starts at its point."""
        return np.eye(3), self._point

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance to the lateral surface."""
        result: FloatArray = np.linalg.norm(points @ self._across, axis=1) - self.radius_mm
        return result

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Normals point away from the axis; across it the surface curves with the distance from it."""
        outward = points @ self._across
        reach = np.maximum(np.linalg.norm(outward, axis=1), 1e-300)
        normals = outward / reach[:, None]
        hessians = (self._across - normals[:, :, None] * normals[:, None, :]) / reach[:, None, None]
        return normals, hessians
