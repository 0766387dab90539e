"""Fine triangulations of a deformed organ, with a bound of their chord error."""

import numpy as np

from glisson.core import TetMesh
from glisson.core.mesh import TET_EDGES, TriangleSurface
from glisson.geometry.shape_functions import shape_values


def organ_surface(mesh: TetMesh, positions, parts: int) -> tuple[TriangleSurface, float]:
    """The boundary of a T10 mesh with its nodes at `positions`, every side of a face cut in `parts`.

    On a side with a middle node m off the middle of its chord, a quadratic face is off its plane triangle by
    4 λa λb m; cut in n parts, m shrinks to m / n². Σ λa λb ≤ 1/3, so the triangles are off by 4/3 max|m| / n² at most.
    """
    faces, elements = mesh.boundary()
    weights, pieces = _pieces(parts)
    local = np.argmax(mesh.corners[elements][:, None, :] == faces[:, :, None], axis=2)
    coordinates = np.zeros((len(faces), len(weights), 4))
    np.put_along_axis(coordinates, local[:, None, :], (weights / parts)[None], axis=2)
    shapes = shape_values(coordinates.reshape(-1, 4), True).reshape(len(faces), len(weights), 10)
    nodal = positions[mesh.tetrahedra[elements]]
    points = np.einsum("fpa,fai->fpi", shapes, nodal).reshape(-1, 3)
    # Points on shared sides are told by their corner nodes and weights, which are whole numbers.
    nodes = np.where(weights > 0, faces[:, None, :], -1)
    order = np.argsort(nodes, axis=2)
    owned = np.take_along_axis(np.broadcast_to(weights, nodes.shape), order, axis=2)
    keys = np.concatenate([np.take_along_axis(nodes, order, axis=2), owned], axis=2).reshape(-1, 6)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    triangles = (np.arange(len(faces))[:, None, None] * len(weights) + pieces).reshape(-1, 3)
    surface = TriangleSurface(points[first], number.reshape(-1)[triangles])
    on_face = (mesh.corners[elements][:, TET_EDGES][..., None] == faces[:, None, None, :]).any(axis=3).all(axis=2)
    bulges = np.linalg.norm(nodal[:, 4:] - nodal[:, TET_EDGES].mean(axis=2), axis=2)[on_face]
    return surface, float(4.0 / 3.0 * bulges.max() / parts**2)


def _pieces(parts: int):
    """Corner weights (p, 3), whole numbers that sum to `parts`, and the small triangles (parts², 3)."""
    grid = [(a, b) for a in range(parts + 1) for b in range(parts + 1 - a)]
    number = {place: n for n, place in enumerate(grid)}
    upright = [(number[a, b], number[a + 1, b], number[a, b + 1]) for a, b in grid if a + b < parts]
    others = [(number[a + 1, b], number[a + 1, b + 1], number[a, b + 1]) for a, b in grid if a + b < parts - 1]
    weights = np.array([(parts - a - b, a, b) for a, b in grid])
    return weights, np.array(upright + others)
