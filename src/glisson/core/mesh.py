"""Meshes: the organ's surface (`TriangleSurface`) and its volume (`TetMesh`), nodes in LPS mm."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import (
    FloatArray,
    IntArray,
    check_range,
    frozen_floats,
    frozen_ints,
)
from glisson.core.errors import BadInput

TET_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Corner numbers of the four faces of a tetrahedron, normals outward (face f is opposite corner f)."""

TET_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
"""Corner numbers of the six edges; T10 node 4 + e is the middle of edge e (VTK and CalculiX order)."""


@dataclass(frozen=True, eq=False)
class TriangleSurface:
    """Triangles (m, 3) over vertices (n, 3) in mm; normals point out of the body."""

    vertices: FloatArray
    triangles: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "vertices", frozen_floats(self.vertices, (None, 3), "surface vertices"))
        object.__setattr__(self, "triangles", frozen_ints(self.triangles, (None, 3), "surface triangles"))
        check_range(self.triangles, len(self.vertices), "A surface triangle")

    @property
    def is_closed(self) -> bool:
        """Whether every edge is shared by exactly two triangles, once in each direction."""
        edges = self.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        keys = edges[:, 0] * len(self.vertices) + edges[:, 1]
        back = edges[:, 1] * len(self.vertices) + edges[:, 0]
        forward = set(keys.tolist())
        return len(forward) == len(keys) and set(back.tolist()) <= forward

    @property
    def volume_mm3(self) -> float:
        """Enclosed volume in mm³ by the divergence theorem (meaningful when closed)."""
        a, b, c = (self.vertices[self.triangles[:, n]] for n in range(3))
        return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)

    @property
    def triangle_areas_mm2(self) -> FloatArray:
        """Area of each triangle (m,) in mm²."""
        a, b, c = (self.vertices[self.triangles[:, n]] for n in range(3))
        areas: FloatArray = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        return areas


@dataclass(frozen=True, eq=False)
class TetMesh:
    """Tetrahedra over nodes (n, 3) in mm, with a region number for each element.

    `tetrahedra` is (m, 4) for T4 or (m, 10) for T10 (corners first, then the middles of `TET_EDGES`).
    All elements are positively oriented; `regions` is (m,) and defaults to zeros.
    """

    nodes: FloatArray
    tetrahedra: IntArray
    regions: IntArray | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", frozen_floats(self.nodes, (None, 3), "mesh nodes"))
        count = np.shape(self.tetrahedra)[-1] if np.ndim(self.tetrahedra) == 2 else 0
        if count not in (4, 10):
            raise BadInput("Tetrahedra must have 4 or 10 nodes each.")
        object.__setattr__(self, "tetrahedra", frozen_ints(self.tetrahedra, (None, count), "tetrahedra"))
        if len(self.tetrahedra) == 0:
            raise BadInput("A mesh needs at least one tetrahedron.")
        check_range(self.tetrahedra, len(self.nodes), "A tetrahedron")
        regions = np.zeros(len(self.tetrahedra)) if self.regions is None else self.regions
        object.__setattr__(self, "regions", frozen_ints(regions, (len(self.tetrahedra),), "mesh regions"))
        inverted = int((self.corner_volumes_mm3 <= 0.0).sum())
        if inverted:
            raise BadInput(f"{inverted} tetrahedra are flat or inside out; repair the mesh first.")

    @property
    def corners(self) -> IntArray:
        """The four corner nodes of each element, (m, 4)."""
        return self.tetrahedra[:, :4]

    @property
    def is_quadratic(self) -> bool:
        """Whether elements are T10."""
        return bool(self.tetrahedra.shape[1] == 10)

    @property
    def region_numbers(self) -> IntArray:
        """The region of each element, (m,)."""
        assert self.regions is not None  # set in __post_init__
        return self.regions

    @property
    def corner_volumes_mm3(self) -> FloatArray:
        """Signed volume of each element's straight-edged tetrahedron, (m,) in mm³."""
        return signed_volumes(self.nodes, self.corners)

    @property
    def volume_mm3(self) -> float:
        """Volume of the mesh (straight edges) in mm³."""
        return float(self.corner_volumes_mm3.sum())

    def boundary(self) -> tuple[IntArray, IntArray]:
        """Outward corner triangles (f, 3) of the boundary in mesh node numbers, and their elements (f,)."""
        faces = self.corners[:, TET_FACES].reshape(-1, 3)
        keys = np.sort(faces, axis=1)
        order = np.lexsort(keys.T)
        same = np.all(keys[order[1:]] == keys[order[:-1]], axis=1)
        alone = np.append(True, ~same) & np.append(~same, True)
        keep = np.sort(order[alone])
        return faces[keep], keep // 4

    def surface(self) -> TriangleSurface:
        """The boundary as a surface with its own vertex numbers."""
        triangles, _ = self.boundary()
        used, renumbered = np.unique(triangles, return_inverse=True)
        return TriangleSurface(self.nodes[used], renumbered.reshape(-1, 3))

    def moved(self, displacement: FloatArray) -> FloatArray:
        """Node positions (n, 3) after a nodal displacement (n, 3), in mm."""
        return self.nodes + displacement

    def as_quadratic(self) -> "TetMesh":
        """The same shape as T10: a node on the middle of every edge (this mesh if it is T10 already)."""
        if self.is_quadratic:
            return self
        edges = np.sort(self.corners[:, TET_EDGES].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middles = self.nodes[unique].mean(axis=1)
        tetrahedra = np.hstack([self.corners, len(self.nodes) + inverse.reshape(-1, 6)])
        return TetMesh(np.vstack([self.nodes, middles]), tetrahedra, self.regions)


def signed_volumes(nodes: FloatArray, corners: IntArray) -> FloatArray:
    """Signed volumes (m,) in mm³ of tetrahedra given by corner numbers (m, 4)."""
    a, b, c, d = (nodes[corners[:, n]] for n in range(4))
    volumes: FloatArray = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a) / 6.0
    return volumes
