"""Carrying points with a deformation: from the scanned shape A to B, and back."""

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.geometry.location import Location, PointLocator


class PointMap:
    """The map of material points that a nodal displacement (n, 3) in mm makes of a mesh.

    Points outside the mesh move with its nearest part, the displacement going on linearly.
    """

    def __init__(self, mesh: TetMesh, displacement: FloatArray) -> None:
        """Prepare the map of `mesh` in A with `displacement` (n, 3).

        Raises:
            BadInput: the displacement belongs to another mesh.
        """
        if np.shape(displacement) != mesh.nodes.shape:
            raise BadInput(f"{len(displacement)} displacements do not fit a mesh of {len(mesh.nodes)} nodes.")
        self.mesh = mesh
        self._displacement = np.asarray(displacement, dtype=np.float64)
        self._in_a = PointLocator(mesh)
        self._in_b: PointLocator | None = None

    def locate(self, points: ArrayLike) -> Location:
        """Where points (n, 3) of A lie in the mesh."""
        return self._in_a.locate(points)

    def forward(self, points: ArrayLike) -> FloatArray:
        """Where the material points at (n, 3) mm of A are in B, (n, 3) mm."""
        places = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        return places + self._in_a.interpolate(self._in_a.locate(places), self._displacement)

    def back(self, points: ArrayLike) -> FloatArray:
        """Where the material points at (n, 3) mm of B were in A, (n, 3) mm."""
        if self._in_b is None:
            self._in_b = PointLocator(self.mesh, self.mesh.moved(self._displacement))
        return self._in_b.interpolate(self._in_b.locate(points), self.mesh.nodes)
