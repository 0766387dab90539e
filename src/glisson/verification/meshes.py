"""Round bodies: discs of triangles, tetrahedra between layers of them, and a ball."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TetMesh

Lengths = Sequence[float] | FloatArray

_BETWEEN = {frozenset((int(a), int(b))): 4 + n for n, (a, b) in enumerate(TET_EDGES)}  # T10's middle nodes
_DIAGONAL = (_BETWEEN[frozenset((0, 1))], _BETWEEN[frozenset((2, 3))])  # the diagonal of the inner octahedron
_RING = [_BETWEEN[frozenset(ends)] for ends in ((0, 2), (1, 2), (1, 3), (0, 3))]
_EIGHTHS = np.array(
    [
        *([c, *(_BETWEEN[frozenset((c, other))] for other in range(4) if other != c)] for c in range(4)),
        *([*_DIAGONAL, _RING[n], _RING[(n + 1) % 4]] for n in range(4)),
    ]
)


def disc(radii: Lengths, counts: Sequence[int], angle: float = 2.0 * np.pi) -> tuple[FloatArray, IntArray]:
    """Points (n, 2) on rings about the origin, the first point, and triangles (m, 3) between them.

    Args:
        radii: of the rings in mm, ascending.
        counts: parts in which each ring is cut.
        angle: 2π, or less for a sector from the x axis on.
    """
    closed = angle > 2.0 * np.pi - 1e-9
    points = [np.zeros((1, 2))]
    for radius, count in zip(radii, counts, strict=True):
        angles = angle * np.arange(count + (not closed)) / count
        points.append(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    # Rounded, so that the straight sides of a sector are straight.
    places = np.vstack(points).round(12) + 0.0
    triangles = Delaunay(places).simplices.astype(np.int64)
    a, b, c = (places[triangles[:, n]] for n in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    triangles = np.where(areas[:, None] < 0.0, triangles[:, ::-1], triangles)
    return places, triangles[np.abs(areas) > 1e-9]


def extruded(points: FloatArray, triangles: IntArray, heights: Lengths) -> TetMesh:
    """T4 mesh of the triangles (m, 3) over points (n, 2), extruded along z through `heights` in mm.

    A prism is cut in three along its sorted corners, so that neighbours share the diagonals of their sides.
    """
    count = len(points)
    nodes = np.vstack([np.column_stack([points, np.full(count, height)]) for height in heights])
    low = np.sort(triangles, axis=1)
    a, b, c = low.T
    prism = np.stack(
        [
            np.stack([a, b, c, c + count], axis=1),
            np.stack([a, b, b + count, c + count], axis=1),
            np.stack([a, a + count, b + count, c + count], axis=1),
        ],
        axis=1,
    ).reshape(-1, 4)
    tetrahedra = np.vstack([prism + layer * count for layer in range(len(heights) - 1)])
    return _positive(nodes, tetrahedra)


def rounded(mesh: TetMesh, radius_mm: float) -> TetMesh:
    """The T10 mesh with the middles of edges between two nodes on a cylinder about the z axis put on it."""
    reach = np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 1])
    on = np.abs(reach - radius_mm) < 1e-9
    middles = mesh.tetrahedra[:, 4:][on[mesh.corners[:, TET_EDGES]].all(axis=2)]
    nodes = np.array(mesh.nodes)
    nodes[middles, :2] *= (radius_mm / reach[middles])[:, None]
    return TetMesh(nodes, mesh.tetrahedra, mesh.regions)


def ball(radius_mm: float, refinements: int) -> TetMesh:
    """T10 mesh of a ball about the origin: an icosahedron cut in 20 · 8ʳ tetrahedra, its boundary's nodes put on it."""
    golden = 0.5 * (1.0 + np.sqrt(5.0))
    corners = [(0.0, a, b * golden) for a in (-1.0, 1.0) for b in (-1.0, 1.0)]
    outside = np.array([np.roll(corner, turn) for corner in corners for turn in range(3)])
    nodes = np.vstack([np.zeros((1, 3)), outside / np.linalg.norm(outside[0])])
    faces = 1 + ConvexHull(nodes[1:]).simplices
    mesh = _positive(nodes, np.column_stack([np.zeros(len(faces), dtype=np.int64), faces]))
    for _ in range(refinements):
        mesh = _cut_in_eight(mesh)
    mesh = mesh.as_quadratic()
    # On shells of equal distance on every ray; a flat face of the icosahedron has a distance of 1 inside it.
    normals = nodes[faces].mean(axis=1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    depth = (mesh.nodes @ normals.T).max(axis=1) / float((nodes[faces[0]] @ normals[0]).mean())
    lengths = np.linalg.norm(mesh.nodes, axis=1)
    places = mesh.nodes * (radius_mm * depth / np.maximum(lengths, 1e-12))[:, None]
    return TetMesh(places, mesh.tetrahedra)


def _cut_in_eight(mesh: TetMesh) -> TetMesh:
    """A T4 mesh with every element cut at the middles of its edges."""
    quadratic = mesh.as_quadratic()
    parts = quadratic.tetrahedra[:, _EIGHTHS].reshape(-1, 4)
    return _positive(quadratic.nodes, parts)


def _positive(nodes: FloatArray, tetrahedra: IntArray) -> TetMesh:
    """A T4 mesh with elements of negative volume turned round."""
    p = nodes[tetrahedra]
    volumes = np.linalg.det(p[:, 1:] - p[:, :1])
    return TetMesh(nodes, np.where(volumes[:, None] < 0.0, tetrahedra[:, [1, 0, 2, 3]], tetrahedra))
