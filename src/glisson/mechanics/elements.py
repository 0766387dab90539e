"""Quadrature of tetrahedra and of the triangles that bound them."""

from dataclasses import dataclass

import numpy as np
from scipy.special import roots_jacobi, roots_legendre

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TetMesh
from glisson.geometry.shape_functions import shape_slopes, shape_values

_OUTER = (5.0 - np.sqrt(5.0)) / 20.0  # of the four-point rule of degree 2 (Keast 1986)


@dataclass(frozen=True, eq=False)
class ElementQuadrature:
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
    jacobians = np.einsum("mai,qak->mqik", nodes[mesh.tetrahedra], derivatives)
    gradients = np.einsum("qak,mqki->mqai", derivatives, np.linalg.inv(jacobians))
    volumes = np.linalg.det(jacobians) * weights / 6.0
    return ElementQuadrature(np.ascontiguousarray(gradients), np.ascontiguousarray(volumes))


def nodal_volumes(nodes: FloatArray, mesh: TetMesh, element_factors: FloatArray) -> FloatArray:
    """∫ factor N_a dV for every node (n,), `element_factors` (m,) being constant in each element."""
    points, _ = volume_rule(mesh.is_quadratic)
    weights = quadrature(nodes, mesh).weights * element_factors[:, None]
    parts = np.einsum("mq,qa->ma", weights, shape_values(points, mesh.is_quadratic))
    volumes: FloatArray = np.bincount(mesh.tetrahedra.ravel(), parts.ravel(), minlength=len(nodes)).astype(np.float64)
    return volumes


@dataclass(frozen=True, eq=False)
class SurfaceQuadrature:
    """Points on the boundary: nodes (p, 3 or 6), shape functions (p, 3 or 6), areas (p,) mm², outward normals."""

    nodes: IntArray
    shapes: FloatArray
    areas: FloatArray
    normals: FloatArray

    def positions(self, nodal: FloatArray) -> FloatArray:
        """A nodal field (n, 3) at the points, (p, 3)."""
        result: FloatArray = np.einsum("pa,pai->pi", self.shapes, nodal[self.nodes])
        return result

    def part(self, points: IntArray) -> "SurfaceQuadrature":
        """Some of the points."""
        return SurfaceQuadrature(self.nodes[points], self.shapes[points], self.areas[points], self.normals[points])

    def scatter(self, forces: FloatArray, count: int) -> FloatArray:
        """Nodal forces (count, 3) of forces at the points (p, 3)."""
        parts = self.shapes[:, :, None] * forces[:, None, :]
        flat = self.nodes.ravel()
        return np.stack([np.bincount(flat, parts[:, :, i].ravel(), minlength=count) for i in range(3)], axis=1)


def surface_quadrature(nodes: FloatArray, mesh: TetMesh, order: int = 4) -> SurfaceQuadrature:
    """order² points on every boundary face, by the conical product rule (Stroud 1971): positive weights.

    Contact is integrated here and not at the nodes, because a nodal contact lets the corners of a tool
    sink between the nodes; areas are those of the shape in `nodes`.
    """
    triangles, elements = mesh.boundary()
    barycentric, weights = triangle_rule(order)
    face_nodes, shapes = triangles, barycentric
    if mesh.is_quadratic:
        face_nodes = np.hstack([triangles, _edge_nodes(mesh, triangles, elements)])
        pairs = barycentric[:, [0, 1, 2]] * barycentric[:, [1, 2, 0]]
        shapes = np.hstack([barycentric * (2.0 * barycentric - 1.0), 4.0 * pairs])
    corners = nodes[triangles]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    doubled = np.linalg.norm(crossed, axis=1)
    count = len(weights)
    return SurfaceQuadrature(
        np.repeat(face_nodes, count, axis=0),
        np.tile(shapes, (len(triangles), 1)),
        (0.5 * doubled[:, None] * weights).ravel(),
        np.repeat(crossed / doubled[:, None], count, axis=0),
    )


def triangle_rule(order: int) -> tuple[FloatArray, FloatArray]:
    """Barycentric points (order², 3) and weights summing to 1, exact to degree 2·order − 1."""
    radial, radial_weights = roots_jacobi(order, 1.0, 0.0)
    across, across_weights = roots_legendre(order)
    radial, across = 0.5 * (radial + 1.0), 0.5 * (across + 1.0)
    first = np.repeat(radial, order)
    second = (1.0 - first) * np.tile(across, order)
    weights = np.outer(radial_weights / radial_weights.sum(), across_weights / across_weights.sum()).ravel()
    return np.stack([1.0 - first - second, first, second], axis=1), weights


def _edge_nodes(mesh: TetMesh, triangles: IntArray, elements: IntArray) -> IntArray:
    """Mid-side nodes (f, 3) of boundary triangles, on the edges 0-1, 1-2 and 2-0."""
    local = np.argmax(mesh.corners[elements][:, None, :] == triangles[:, :, None], axis=2)
    edge_of = np.zeros((4, 4), dtype=np.int64)
    for number, (a, b) in enumerate(TET_EDGES):
        edge_of[a, b] = edge_of[b, a] = 4 + number
    columns = edge_of[local, local[:, [1, 2, 0]]]
    return np.take_along_axis(mesh.tetrahedra[elements], columns, axis=1)
