"""Shape functions of T4 and T10 tetrahedra in barycentric coordinates (node order of `core.mesh`)."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TET_EDGES
from glisson.geometry.compiled import compiled

_FIRST, _SECOND = TET_EDGES[:, 0].copy(), TET_EDGES[:, 1].copy()


def shape_values(coordinates: FloatArray, quadratic: bool) -> FloatArray:
    """Shape function values (n, 4) or (n, 10) at barycentric coordinates (n, 4)."""
    if not quadratic:
        return coordinates
    corners = coordinates * (2.0 * coordinates - 1.0)
    middles = 4.0 * coordinates[:, _FIRST] * coordinates[:, _SECOND]
    return np.hstack([corners, middles])


def shape_slopes(coordinates: FloatArray, quadratic: bool) -> FloatArray:
    """Derivatives (n, 4 or 10, 4) by the four barycentric coordinates, taken as independent."""
    number = len(coordinates)
    if not quadratic:
        return np.broadcast_to(np.eye(4), (number, 4, 4))
    slopes = np.zeros((number, 10, 4))
    for corner in range(4):
        slopes[:, corner, corner] = 4.0 * coordinates[:, corner] - 1.0
    for edge, (a, b) in enumerate(TET_EDGES):
        slopes[:, 4 + edge, a] = 4.0 * coordinates[:, b]
        slopes[:, 4 + edge, b] = 4.0 * coordinates[:, a]
    return slopes


@compiled
def quadratic_position(nodes: FloatArray, coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Position (3,) and Jacobian (3, 3), column k by coordinate k + 1, in one T10 with nodes (10, 3).

    The first barycentric coordinate follows from the others, so it is differentiated as 1 − r − s − t.
    """
    position, slopes = np.zeros(3), np.zeros((3, 4))
    for corner in range(4):
        own = coordinates[corner]
        for axis in range(3):
            position[axis] += own * (2.0 * own - 1.0) * nodes[corner, axis]
            slopes[axis, corner] += (4.0 * own - 1.0) * nodes[corner, axis]
    for edge in range(6):
        a, b = _FIRST[edge], _SECOND[edge]
        for axis in range(3):
            middle = 4.0 * nodes[4 + edge, axis]
            position[axis] += coordinates[a] * coordinates[b] * middle
            slopes[axis, a] += coordinates[b] * middle
            slopes[axis, b] += coordinates[a] * middle
    jacobian = np.zeros((3, 3))
    for axis in range(3):
        for column in range(3):
            jacobian[axis, column] = slopes[axis, column + 1] - slopes[axis, 0]
    return position, jacobian
