"""The organ's boundary as triangles of three or six nodes, and their shape functions."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TetMesh

_SIDES = ((0, 1), (1, 2), (2, 0))
"""Corners at the ends of the sides whose middles are nodes 3 to 5."""


def face_nodes(mesh: TetMesh) -> IntArray:
    """Nodes (f, 3 or 6) of the boundary's faces, in the order of `mesh.boundary()`; normals point outwards."""
    triangles, elements = mesh.boundary()
    if not mesh.is_quadratic:
        return triangles
    return np.hstack([triangles, _middles(mesh, triangles, elements)])


def face_values(barycentric: FloatArray, quadratic: bool) -> FloatArray:
    """Shape functions (q, 3 or 6) at barycentric points (q, 3)."""
    if not quadratic:
        return barycentric
    sides = [4.0 * barycentric[:, a] * barycentric[:, b] for a, b in _SIDES]
    return np.hstack([barycentric * (2.0 * barycentric - 1.0), np.stack(sides, axis=1)])


def face_slopes(barycentric: FloatArray, quadratic: bool) -> FloatArray:
    """Derivatives (q, 3 or 6, 2) of the shape functions by the second and third barycentric coordinate."""
    by_all = np.tile(np.eye(3), (len(barycentric), 1, 1))
    if quadratic:
        by_all = np.zeros((len(barycentric), 6, 3))
        for a in range(3):
            by_all[:, a, a] = 4.0 * barycentric[:, a] - 1.0
        for number, (a, b) in enumerate(_SIDES):
            by_all[:, 3 + number, a] = 4.0 * barycentric[:, b]
            by_all[:, 3 + number, b] = 4.0 * barycentric[:, a]
    slopes: FloatArray = by_all[:, :, 1:] - by_all[:, :, :1]
    return slopes


def exact_rule() -> tuple[FloatArray, FloatArray]:
    """Barycentric points (16, 3) and weights that sum to 1, exact to degree 6 (a square's Gauss rule, collapsed)."""
    places, weights = np.polynomial.legendre.leggauss(4)
    places, weights = 0.5 * (places + 1.0), 0.5 * weights
    u, v = (axis.ravel() for axis in np.meshgrid(places, places, indexing="ij"))
    factors = np.outer(weights, weights).ravel() * 2.0 * (1.0 - u)
    return np.stack([(1.0 - u) * (1.0 - v), u, (1.0 - u) * v], axis=1), factors


def _middles(mesh: TetMesh, triangles: IntArray, elements: IntArray) -> IntArray:
    """Mid-side nodes (f, 3) of boundary triangles, on the sides 0-1, 1-2 and 2-0."""
    local = np.argmax(mesh.corners[elements][:, None, :] == triangles[:, :, None], axis=2)
    edge_of = np.zeros((4, 4), dtype=np.int64)
    for number, (a, b) in enumerate(TET_EDGES):
        edge_of[a, b] = edge_of[b, a] = 4 + number
    columns = edge_of[local, local[:, [1, 2, 0]]]
    return np.take_along_axis(mesh.tetrahedra[elements], columns, axis=1)
