"""Structured meshes and closed-form motions for the tests of geometry and navigation."""

from itertools import permutations

import numpy as np

from glisson.core import TetMesh, TriangleSurface
from glisson.core.arrays import FloatArray


def block(
    cells: tuple[int, int, int], size: tuple[float, float, float], origin: tuple[float, float, float] = (0, 0, 0)
):
    """T4 mesh of a box: each cell is cut into the six tetrahedra along its diagonal (Kuhn)."""
    lines = [o + np.linspace(0.0, s, n + 1) for n, s, o in zip(cells, size, origin, strict=True)]
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    numbers = np.arange(len(nodes)).reshape([n + 1 for n in cells])
    tetrahedra = []
    for order in permutations(range(3)):
        corner = np.zeros(3, dtype=int)
        path = [corner.copy()]
        for axis in order:
            corner[axis] += 1
            path.append(corner.copy())
        if np.linalg.det(np.array(path[1:], dtype=float)) < 0.0:
            path[1], path[2] = path[2], path[1]
        views = [numbers[tuple(slice(c, c + n) for c, n in zip(p, cells, strict=True))].ravel() for p in path]
        tetrahedra.append(np.stack(views, axis=1))
    return TetMesh(nodes, np.vstack(tetrahedra))


def bent(points: FloatArray, radius: float = 60.0, height: float = 10.0) -> FloatArray:
    """A bar along x bent about the y axis: the layer z = height keeps its length, on a circle of `radius`."""
    angle, r = points[:, 0] / radius, radius + height - points[:, 2]
    return np.stack([r * np.sin(angle), points[:, 1], radius + height - r * np.cos(angle)], axis=1)


def rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Rodrigues' formula."""
    k = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def sphere(centre: FloatArray, radius: float, level: int = 2) -> TriangleSurface:
    """An octahedron refined `level` times, its vertices on the sphere; normals outward."""
    vertices = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], dtype=float)
    triangles = np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]])
    for _ in range(level):
        edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = (inverse.reshape(-1, 3) + len(vertices)).T
        a, b, c = triangles.T
        middles = vertices[unique].mean(axis=1)
        vertices = np.vstack([vertices, middles / np.linalg.norm(middles, axis=1, keepdims=True)])
        triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    return TriangleSurface(np.asarray(centre) + radius * vertices, triangles)
