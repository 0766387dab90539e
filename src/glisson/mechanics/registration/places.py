"""The model's material points by name: what an observation can be held against."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.model import Model
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.location import PointLocator
from glisson.geometry.quadratic import straight_boundary


@dataclass(frozen=True, eq=False)
class MaterialPoints:
    """Points (m) of the tissue: node numbers (m, a) and their weights (m, a)."""

    nodes: IntArray
    weights: FloatArray

    def at(self, positions: FloatArray) -> FloatArray:
        """Where they are (m, 3) when the nodes are at `positions` (n, 3)."""
        places: FloatArray = np.einsum("ma,mai->mi", self.weights, positions[self.nodes])
        return places


@dataclass(frozen=True, eq=False)
class MaterialCurve:
    """A curve in the tissue: points, and segments (s, 2) between them."""

    points: MaterialPoints
    segments: IntArray


class Places:
    """Looks up parts of a model by the name that an observation gives."""

    def __init__(self, model: Model) -> None:
        self._model, self.nodes = model, model.mesh.nodes
        self._locator = PointLocator(model.mesh)
        self._triangles, _ = straight_boundary(model.mesh)
        self._trees: dict[str, SurfaceTree] = {}

    def tree(self, name: str) -> SurfaceTree:
        """The `surface` of that name in its scanned shape, ready to be moved."""
        if name not in self._trees:
            self._trees[name] = SurfaceTree(self.nodes, self.surface(name))
        return self._trees[name]

    def surface(self, name: str) -> IntArray:
        """Triangles (f, 3) in node numbers: of the node set of that name, else all of the surface."""
        if name not in self._model.node_sets:
            return self._triangles
        chosen = self._triangles[np.isin(self._triangles, self._model.node_sets[name]).all(axis=1)]
        if len(chosen) == 0:
            raise BadInput(f"The node set {name!r} has no triangle of the surface.")
        return chosen

    def landmark(self, name: str) -> MaterialPoints:
        """The middle of the node set of that name.

        Raises:
            BadInput: there is none.
        """
        nodes = self._model.node_set(name)
        return MaterialPoints(nodes[None, :], np.full((1, len(nodes)), 1.0 / len(nodes)))

    def curve(self, name: str) -> MaterialCurve:
        """A named curve, the wire's duct ("wire", "duct"), a vessel tree, or the surface's edges within a node set.

        Raises:
            BadInput: there is none of that name.
        """
        structures = self._model.structures
        line = structures.duct if name in ("wire", "duct") else structures.curves.get(name)
        if line is not None:
            points = line.points_mm
            return MaterialCurve(self.located(points), _chain(len(points)))
        for tree in structures.trees:
            if tree.name == name:
                return MaterialCurve(self.located(tree.points_mm), tree.edges)
        nodes = self._model.node_set(name)
        edges = np.sort(self._triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        edges = np.unique(edges[np.isin(edges, nodes).all(axis=1)], axis=0)
        if len(edges) == 0:
            raise BadInput(f"The node set {name!r} has no edge of the surface to be a curve.")
        used, renumbered = np.unique(edges, return_inverse=True)
        return MaterialCurve(MaterialPoints(used[:, None], np.ones((len(used), 1))), renumbered.reshape(-1, 2))

    def located(self, points_mm: FloatArray) -> MaterialPoints:
        """Points (m, 3) of the scanned shape."""
        location = self._locator.locate(points_mm)
        return MaterialPoints(self._model.mesh.tetrahedra[location.elements], self._locator.weights(location))


def _chain(count: int) -> IntArray:
    return np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
