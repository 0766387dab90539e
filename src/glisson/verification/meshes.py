"""Round bodies: discs of triangles, and tetrahedra between layers of them."""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import Delaunay

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TetMesh

Lengths = Sequence[float] | FloatArray


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
    p = nodes[tetrahedra]
    volumes = np.linalg.det(p[:, 1:] - p[:, :1])
    tetrahedra = np.where(volumes[:, None] < 0.0, tetrahedra[:, [1, 0, 2, 3]], tetrahedra)
    return TetMesh(nodes, tetrahedra)


def rounded(mesh: TetMesh, radius_mm: float) -> TetMesh:
    """The T10 mesh with the middles of edges between two nodes on a cylinder about the z axis put on it."""
    reach = np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 1])
    on = np.abs(reach - radius_mm) < 1e-9
    middles = mesh.tetrahedra[:, 4:][on[mesh.corners[:, TET_EDGES]].all(axis=2)]
    nodes = np.array(mesh.nodes)
    nodes[middles, :2] *= (radius_mm / reach[middles])[:, None]
    return TetMesh(nodes, mesh.tetrahedra, mesh.regions)
