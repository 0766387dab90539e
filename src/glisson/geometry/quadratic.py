"""Curved T10 elements and facets as several straight ones, so that their mid-side nodes count."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_FACES, TetMesh, TriangleSurface

# Bey 1995: four corner tetrahedra, and the inner octahedron cut along the diagonal between the middles of
# edges (0, 2) and (1, 3). Local node numbers as in core.mesh (4 = 01, 5 = 12, 6 = 02, 7 = 03, 8 = 13, 9 = 23).
_EIGHT = np.array(
    [
        [0, 4, 6, 7],
        [4, 1, 5, 8],
        [6, 5, 2, 9],
        [7, 8, 9, 3],
        [4, 6, 7, 8],
        [4, 5, 6, 8],
        [6, 9, 7, 8],
        [6, 5, 9, 8],
    ]
)

# Middles of the edges (a, b), (b, c), (c, a) of each face of TET_FACES, as local T10 numbers.
_FACE_MIDDLES = np.array([[5, 9, 8], [7, 9, 6], [4, 8, 7], [6, 5, 4]])


def straight_tetrahedra(mesh: TetMesh) -> IntArray:
    """Corner numbers (m, 4) of T4 elements, or (8m, 4) for T10: eight straight tetrahedra each, in order."""
    if not mesh.is_quadratic:
        return mesh.corners
    return mesh.tetrahedra[:, _EIGHT].reshape(-1, 4)


def straight_boundary(mesh: TetMesh) -> tuple[IntArray, IntArray]:
    """Outward boundary triangles (f, 3) in mesh node numbers and their elements (f,).

    Each T10 facet gives four triangles, in order.
    """
    faces = np.sort(mesh.corners[:, TET_FACES].reshape(-1, 3), axis=1)
    _, index, counts = np.unique(faces, axis=0, return_index=True, return_counts=True)
    outer = np.sort(index[counts == 1])
    elements, sides = outer // 4, outer % 4
    corners = np.take_along_axis(mesh.tetrahedra[elements], TET_FACES[sides], axis=1)
    if not mesh.is_quadratic:
        return corners, elements
    ab, bc, ca = np.take_along_axis(mesh.tetrahedra[elements], _FACE_MIDDLES[sides], axis=1).T
    a, b, c = corners.T
    four = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1)
    return four.reshape(-1, 3), np.repeat(elements, 4)


def boundary_surface(mesh: TetMesh, nodes: FloatArray | None = None) -> TriangleSurface:
    """The boundary with mid-side nodes as vertices, at `nodes` (n, 3) mm (deformed) or as the mesh has them."""
    triangles, _ = straight_boundary(mesh)
    used, renumbered = np.unique(triangles, return_inverse=True)
    places = mesh.nodes if nodes is None else nodes
    return TriangleSurface(places[used], renumbered.reshape(-1, 3))
