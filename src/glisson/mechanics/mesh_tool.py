"""A rigid tool given by a closed triangle surface."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.tools import MeshTool
from glisson.geometry.distance import SurfaceTree
from glisson.mechanics.carried_tool import CarriedTool

_NEAR_MM = 15.0  # beyond it the distance to the surface's box stands for the surface's
_ON_A_CORNER = 1e-9  # barycentric coordinate that counts as none


class SurfaceTool(CarriedTool):
    """The surface's inside and all within `skin_mm` of it."""

    def __init__(self, tool: MeshTool, moves: bool = False) -> None:
        super().__init__(tool.name, tool.skin_mm, moves)
        self._skin = tool.skin_mm
        self._corners = tool.surface.vertices[tool.surface.triangles]
        self._tree = SurfaceTree(tool.surface.vertices, tool.surface.triangles)
        self._low, self._high = tool.surface.vertices.min(axis=0), tool.surface.vertices.max(axis=0)

    def distance(self, points: FloatArray) -> FloatArray:
        """Signed distance to the skin; far away a smaller one."""
        distance = np.linalg.norm(np.maximum(np.maximum(self._low - points, points - self._high), 0.0), axis=1)
        near = np.flatnonzero(distance < _NEAR_MM)
        found = self._tree.nearest(points[near]).distance_mm
        distance[near] = np.where(self._tree.contains(points[near]), -found, found)
        result: FloatArray = distance - self._skin
        return result

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Flat over triangles, round about edges and corners."""
        if not len(points):
            return np.zeros((0, 3)), np.zeros((0, 3, 3))
        nearest = self._tree.nearest(points)
        corners = self._corners[nearest.triangles]
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        faces /= np.linalg.norm(faces, axis=1, keepdims=True)
        side = np.where(self._tree.contains(points), -1.0, 1.0)
        reach = np.maximum(nearest.distance_mm, 1e-9)
        outward = side[:, None] * (points - nearest.closest_mm) / reach[:, None]
        normals = np.where((nearest.distance_mm < 1e-9)[:, None], faces, outward)
        gone = nearest.barycentric < _ON_A_CORNER
        on_edge, on_corner = gone.sum(axis=1) == 1, gone.sum(axis=1) == 2
        missing = gone.argmax(axis=1)
        rows = np.arange(len(points))
        edges = corners[rows, (missing + 2) % 3] - corners[rows, (missing + 1) % 3]
        edges /= np.linalg.norm(edges, axis=1, keepdims=True)
        flat = np.eye(3) - normals[:, :, None] * normals[:, None, :]
        along = edges[:, :, None] * edges[:, None, :]
        bent = np.where(on_corner[:, None, None], flat, np.where(on_edge[:, None, None], flat - along, 0.0))
        return normals, (side / reach)[:, None, None] * bent
