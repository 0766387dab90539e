"""Quadrature of tetrahedra and of the triangles that bound them."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.sparse import csr_array

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.geometry.shape_functions import shape_slopes, shape_values
from glisson.mechanics.faces import face_nodes, face_values

_OUTER = (5.0 - np.sqrt(5.0)) / 20.0  # of the four-point rule of degree 2 (Keast 1986)


class ElementQuadrature(NamedTuple):
    """∂N/∂X at the quadrature points (m, q, nodes, 3) in 1/mm and weights (m, q) in mm³."""

    gradients: FloatArray
    weights: FloatArray


def volume_rule(quadratic: bool) -> tuple[FloatArray, FloatArray]:
    """Barycentric points (q, 4) and weights (q,) summing to 1: one point for T4, four for T10."""
    if not quadratic:
        return np.full((1, 4), 0.25), np.ones(1)
    points = np.full((4, 4), _OUTER)
    np.fill_diagonal(points, 1.0 - 3.0 * _OUTER)
    return points, np.full(4, 0.25)


def quadrature(nodes: FloatArray, mesh: TetMesh) -> ElementQuadrature:
    """Quadrature of the elements of `mesh` with its nodes at `nodes` (curved T10 edges count)."""
    points, weights = volume_rule(mesh.is_quadratic)
    slopes = shape_slopes(points, mesh.is_quadratic)
    derivatives = slopes[:, :, 1:] - slopes[:, :, :1]  # the first barycentric coordinate follows from the others
    return ElementQuadrature(*_mapped(nodes, mesh.tetrahedra, np.ascontiguousarray(derivatives), weights / 6.0))


@njit(cache=True, nogil=True)
def _mapped(
    nodes: FloatArray, tetrahedra: IntArray, derivatives: FloatArray, weights: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Derivatives (q, nodes, 3) of the shape functions and weights (q,), taken to the elements' own coordinates."""
    points, size = derivatives.shape[0], derivatives.shape[1]
    gradients, volumes = np.zeros((len(tetrahedra), points, size, 3)), np.zeros((len(tetrahedra), points))
    jacobian, cofactors = np.zeros((3, 3)), np.zeros((3, 3))
    for e in range(len(tetrahedra)):
        for q in range(points):
            jacobian[:] = 0.0
            for a in range(size):
                for i in range(3):
                    for k in range(3):
                        jacobian[i, k] += nodes[tetrahedra[e, a], i] * derivatives[q, a, k]
            for i in range(3):
                j, m = (i + 1) % 3, (i + 2) % 3
                for k in range(3):
                    n, p = (k + 1) % 3, (k + 2) % 3
                    cofactors[i, k] = jacobian[j, n] * jacobian[m, p] - jacobian[j, p] * jacobian[m, n]
            determinant = 0.0
            for k in range(3):
                determinant += jacobian[0, k] * cofactors[0, k]
            volumes[e, q] = determinant * weights[q]
            for a in range(size):
                for i in range(3):
                    value = 0.0
                    for k in range(3):
                        value += cofactors[i, k] * derivatives[q, a, k]
                    gradients[e, q, a, i] = value / determinant
    return gradients, volumes


def nodal_volumes(nodes: FloatArray, mesh: TetMesh, element_factors: FloatArray) -> FloatArray:
    """∫ factor N_a dV for every node (n,), `element_factors` (m,) being constant in each element."""
    points, _ = volume_rule(mesh.is_quadratic)
    weights = quadrature(nodes, mesh).weights * element_factors[:, None]
    parts = np.einsum("mq,qa->ma", weights, shape_values(points, mesh.is_quadratic))
    volumes: FloatArray = np.bincount(mesh.tetrahedra.ravel(), parts.ravel(), minlength=len(nodes)).astype(np.float64)
    return volumes


def lumped_volumes(nodes: FloatArray, mesh: TetMesh) -> FloatArray:
    """Equal parts of the elements' volumes at their nodes (n,), all positive."""
    size = mesh.tetrahedra.shape[1]
    parts = np.repeat(quadrature(nodes, mesh).weights.sum(axis=1) / size, size)
    volumes: FloatArray = np.bincount(mesh.tetrahedra.ravel(), parts, minlength=len(nodes)).astype(np.float64)
    return volumes


@dataclass(frozen=True, eq=False)
class SurfaceQuadrature:
    """Points on the boundary: nodes (p, 3 or 6), shape functions (p, 3 or 6), areas (p,) mm², outward normals.

    `count` is the number of nodes of the fields that are taken at the points.
    """

    nodes: IntArray
    shapes: FloatArray
    areas: FloatArray
    normals: FloatArray
    count: int

    @cached_property
    def _sampling(self) -> csr_array:
        points, size = self.shapes.shape
        starts = np.arange(0, points * size + 1, size)
        return csr_array((self.shapes.ravel(), self.nodes.ravel(), starts), shape=(points, self.count))

    @cached_property
    def _gathering(self) -> csr_array:
        return self._sampling.T.tocsr()

    def positions(self, nodal: FloatArray) -> FloatArray:
        """A nodal field (count, 3) at the points, (p, 3)."""
        result: FloatArray = self._sampling @ nodal
        return result

    def part(self, points: IntArray) -> "SurfaceQuadrature":
        """Some of the points."""
        rows = (self.nodes[points], self.shapes[points], self.areas[points], self.normals[points])
        return SurfaceQuadrature(*rows, self.count)

    def scatter(self, forces: FloatArray) -> FloatArray:
        """Nodal forces (count, 3) of forces at the points (p, 3)."""
        result: FloatArray = self._gathering @ forces
        return result


def surface_quadrature(nodes: FloatArray, mesh: TetMesh, parts: IntArray | int = 2) -> SurfaceQuadrature:
    """Points on every boundary face (in the order of `mesh.boundary()`), each side of which is cut in `parts` (f,).

    Contact is integrated here and not at the nodes, because a nodal contact lets the corners of a tool
    sink between the nodes; areas are those of the shape in `nodes`.
    """
    of_faces = face_nodes(mesh)
    corners = nodes[of_faces[:, :3]]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(crossed, axis=1)
    parts = np.broadcast_to(np.asarray(parts), (len(of_faces),))
    found = []
    for number in np.unique(parts):
        faces = np.flatnonzero(parts == number)
        barycentric, weights = triangle_rule(int(number))
        shapes = face_values(barycentric, mesh.is_quadratic)
        found.append(
            (
                np.repeat(of_faces[faces], len(weights), axis=0),
                np.tile(shapes, (len(faces), 1)),
                (0.5 * doubled[faces, None] * weights).ravel(),
                np.repeat(crossed[faces] / doubled[faces, None], len(weights), axis=0),
            )
        )
    rows = [np.concatenate(parts) for parts in zip(*found, strict=True)]
    return SurfaceQuadrature(rows[0], rows[1], rows[2], rows[3], len(nodes))


def triangle_rule(parts: int) -> tuple[FloatArray, FloatArray]:
    """Barycentric points (3 parts², 3) and weights summing to 1, exact to degree 2.

    Every side is cut in `parts`, and each small triangle has three points of equal weight, at a sixth of its height.
    """
    steps = np.arange(parts)
    a, b = (axis.ravel() for axis in np.meshgrid(steps, steps, indexing="ij"))
    corner = np.stack([a, b, parts - a - b], axis=1)
    upright, inverted = corner[corner[:, 2] >= 1], corner[corner[:, 2] >= 2]
    inner = np.array([[4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]) / 6.0
    # From its corner of least first coordinates an upright triangle grows along them; an inverted one is its mirror.
    points = np.concatenate(
        [
            (upright[:, None, :] + inner + [0.0, 0.0, -1.0]).reshape(-1, 3),
            (inverted[:, None, :] + [1.0, 1.0, -1.0] - inner).reshape(-1, 3),
        ]
    )
    return points / parts, np.full(len(points), 1.0 / len(points))
