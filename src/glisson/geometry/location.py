"""Which element holds a point, and where in it: the way from a place to a material point."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TET_EDGES, TetMesh
from glisson.geometry.box_tree import STACK_SIZE, build_box_tree, squared_distance_to_box
from glisson.geometry.compiled import compiled
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.quadratic import straight_boundary
from glisson.geometry.shape_functions import quadratic_position, shape_slopes, shape_values

_INSIDE = -1e-9
"""Barycentric coordinates down to this count as inside: rounding on a shared face."""

_TOUCHING = 1e-14
"""Squared distance (mm²) to a box that still counts as touching it."""

_NEWTON_STEPS = 25


@dataclass(frozen=True, eq=False)
class Location:
    """Where n points lie: elements (n,), barycentric coordinates (n, 4), distance to the mesh (n,) in mm.

    Outside points (`distance_mm` > 0) name the nearest element and have a negative coordinate.
    """

    elements: IntArray
    coordinates: FloatArray
    distance_mm: FloatArray


class PointLocator:
    """A mesh prepared to locate many points in it.

    Straight elements are solved exactly; curved T10 (mid-side nodes off the middle) by Newton's method
    within boxes of their Bézier control points, which contain the element.
    """

    def __init__(self, mesh: TetMesh, nodes: FloatArray | None = None) -> None:
        """Prepare `mesh` at its own nodes, or at deformed `nodes` (n, 3) in mm.

        Raises:
            BadInput: `nodes` belong to another mesh.
        """
        self.mesh = mesh
        self._nodes = mesh.nodes if nodes is None else np.ascontiguousarray(nodes, dtype=np.float64)
        if self._nodes.shape != mesh.nodes.shape:
            raise BadInput(f"{len(self._nodes)} node positions do not fit a mesh of {len(mesh.nodes)} nodes.")
        self._curved = mesh.is_quadratic and not _is_straight(mesh, self._nodes)
        elements = mesh.tetrahedra if self._curved else mesh.corners
        self._places = np.ascontiguousarray(self._nodes[elements])
        bounds = _control_points(self._places) if self._curved else self._places
        self._tree = build_box_tree(bounds.min(axis=1), bounds.max(axis=1))
        self._surface: tuple[SurfaceTree, IntArray] | None = None

    def locate(self, points: ArrayLike) -> Location:
        """Locate points (n, 3) in mm; see `Location` for points outside."""
        places = np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 3))
        elements, coordinates = _find(places, self._places, self._curved, *self._tree)
        distance = np.zeros(len(places))
        outside = np.flatnonzero(elements < 0)
        if len(outside):
            self._extrapolate(places, outside, elements, coordinates, distance)
        return Location(elements, coordinates, distance)

    def interpolate(self, location: Location, nodal: FloatArray) -> FloatArray:
        """Values (n, k) of a nodal field (N, k) at located points, by T4 or T10 shape functions.

        Outside the mesh the field goes on linearly (first Taylor term at the nearest place inside), since
        quadratic shape functions run away there.
        """
        local = nodal[self.mesh.tetrahedra[location.elements]]
        values: FloatArray = np.einsum("na,nak->nk", self.weights(location), local)
        return values

    def weights(self, location: Location) -> FloatArray:
        """How much (n, 4 or 10) each node of its element counts in the value at a located point; see `interpolate`."""
        quadratic = self.mesh.is_quadratic
        nearest = _clamped(location.coordinates)
        weights = shape_values(nearest, quadratic)
        out = np.flatnonzero(location.coordinates.min(axis=1) < 0.0)
        if len(out):
            beyond = location.coordinates[out] - nearest[out]
            weights[out] += np.einsum("nai,ni->na", shape_slopes(nearest[out], quadratic), beyond)
        return weights

    def _extrapolate(
        self, points: FloatArray, outside: IntArray, elements: IntArray, coordinates: FloatArray, distance: FloatArray
    ) -> None:
        """Fill in the nearest element, its linearly extended coordinates and the distance of outside points."""
        if self._surface is None:
            triangles, owners = straight_boundary(self.mesh)
            self._surface = SurfaceTree(self._nodes, triangles), owners
        tree, owners = self._surface
        nearest = tree.nearest(points[outside])
        elements[outside] = owners[nearest.triangles]
        distance[outside] = nearest.distance_mm
        coordinates[outside] = _affine_coordinates(points[outside], self._places[elements[outside]])
        if self._curved:
            _extend_curved(points[outside], self._places[elements[outside]], coordinates, outside)


def _is_straight(mesh: TetMesh, nodes: FloatArray) -> bool:
    """Whether every mid-side node lies on the middle of its edge."""
    ends = nodes[mesh.corners[:, TET_EDGES]]
    off = np.abs(nodes[mesh.tetrahedra[:, 4:]] - ends.mean(axis=2)).max()
    return bool(off <= 1e-9 * np.ptp(nodes, axis=0).max())


def _control_points(places: FloatArray) -> FloatArray:
    """Bézier control points (m, 10, 3) of T10 elements (m, 10, 3): the element lies in their convex hull."""
    ends = places[:, TET_EDGES]
    return np.concatenate([places[:, :4], 2.0 * places[:, 4:] - ends.mean(axis=2)], axis=1)


def _clamped(coordinates: FloatArray) -> FloatArray:
    """Coordinates (n, 4) with negative ones set to zero and the rest scaled to a sum of one."""
    positive: FloatArray = np.maximum(coordinates, 0.0)
    positive /= positive.sum(axis=1, keepdims=True)
    return positive


def _affine_coordinates(points: FloatArray, places: FloatArray) -> FloatArray:
    """Barycentric coordinates (n, 4) of points (n, 3) in straight tetrahedra (n, ≥ 4, 3)."""
    edges = np.moveaxis(places[:, 1:4] - places[:, :1], 1, 2)
    last = np.linalg.solve(edges, (points - places[:, 0])[:, :, None])[:, :, 0]
    return np.hstack([1.0 - last.sum(axis=1, keepdims=True), last])


def _extend_curved(points: FloatArray, places: FloatArray, coordinates: FloatArray, rows: IntArray) -> None:
    """Solve position(nearest) + slope · (λ − nearest) = point for λ, nearest = λ clamped, by fixed point."""
    current = coordinates[rows]
    for _ in range(8):
        nearest = _clamped(current)
        slopes = np.einsum("nai,nak->nki", shape_slopes(nearest, True), places)
        jacobian = slopes[:, :, 1:] - slopes[:, :, :1]
        missing = points - np.einsum("na,nak->nk", shape_values(nearest, True), places)
        step = np.linalg.solve(jacobian, missing[:, :, None])[:, :, 0]
        current = nearest + np.hstack([-step.sum(axis=1, keepdims=True), step])
    coordinates[rows] = current


@compiled
def _solve3(m: FloatArray, right: FloatArray) -> tuple[float, float, float, float]:
    """Cramer's rule: the three unknowns and the determinant, all zero where the latter vanishes."""
    a, b = m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1], m[0, 2] * m[2, 1] - m[0, 1] * m[2, 2]
    c = m[0, 1] * m[1, 2] - m[0, 2] * m[1, 1]
    determinant = m[0, 0] * a + m[1, 0] * b + m[2, 0] * c
    if determinant == 0.0:
        return 0.0, 0.0, 0.0, 0.0
    d, e = m[1, 2] * m[2, 0] - m[1, 0] * m[2, 2], m[0, 0] * m[2, 2] - m[0, 2] * m[2, 0]
    f = m[0, 2] * m[1, 0] - m[0, 0] * m[1, 2]
    g, h = m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0], m[0, 1] * m[2, 0] - m[0, 0] * m[2, 1]
    i = m[0, 0] * m[1, 1] - m[0, 1] * m[1, 0]
    r = (a * right[0] + b * right[1] + c * right[2]) / determinant
    s = (d * right[0] + e * right[1] + f * right[2]) / determinant
    t = (g * right[0] + h * right[1] + i * right[2]) / determinant
    return r, s, t, determinant


@compiled
def _straight_coordinates(point: FloatArray, places: FloatArray, room: FloatArray) -> FloatArray:
    """Barycentric coordinates of `point` in a straight tetrahedron; `room` (3, 3) is scratch memory."""
    for axis in range(3):
        for column in range(3):
            room[axis, column] = places[column + 1, axis] - places[0, axis]
    r, s, t, _ = _solve3(room, point - places[0])
    return np.array([1.0 - r - s - t, r, s, t])


@compiled
def _newton(point: FloatArray, places: FloatArray, start: FloatArray) -> tuple[FloatArray, bool]:
    """Barycentric coordinates of `point` in a curved T10, and whether Newton's method got there."""
    coordinates = start.copy()
    for _ in range(_NEWTON_STEPS):
        position, jacobian = quadratic_position(places, coordinates)
        r, s, t, determinant = _solve3(jacobian, point - position)
        if determinant <= 0.0:
            return coordinates, False
        coordinates += np.array([-r - s - t, r, s, t])
        largest = max(abs(r), abs(s), abs(t))
        if largest < 1e-13:
            return coordinates, True
        if largest > 10.0:
            return coordinates, False
    return coordinates, largest < 1e-10


@compiled
def _coordinates_in(point: FloatArray, places: FloatArray, curved: bool, room: FloatArray) -> FloatArray:
    """Barycentric coordinates of a point in one element; (−1, −1, −1, −1) where Newton's method fails."""
    straight = _straight_coordinates(point, places, room)
    if not curved:
        return straight
    found, good = _newton(point, places, straight)
    if not good:
        found, good = _newton(point, places, np.full(4, 0.25))
    return found if good else np.full(4, -1.0)


@compiled
def _find(
    points: FloatArray,
    places: FloatArray,
    curved: bool,
    lower: FloatArray,
    upper: FloatArray,
    left: IntArray,
    first: IntArray,
    count: IntArray,
    order: IntArray,
) -> tuple[IntArray, FloatArray]:
    """The element that holds each point most comfortably (−1: none) and the coordinates there."""
    elements, coordinates = np.full(len(points), -1), np.zeros((len(points), 4))
    stack, room = np.zeros(STACK_SIZE, dtype=np.int64), np.zeros((3, 3))
    for i in range(len(points)):
        p, best = points[i], _INSIDE
        stack[0], top = 0, 1
        while top > 0 and best < 0.0:
            top -= 1
            node = stack[top]
            if squared_distance_to_box(p, lower[node], upper[node]) > _TOUCHING:
                continue
            if left[node] >= 0:
                stack[top], stack[top + 1] = left[node], left[node] + 1
                top += 2
                continue
            for slot in range(first[node], first[node] + count[node]):
                found = _coordinates_in(p, places[order[slot]], curved, room)
                least = np.min(found)
                if least >= best:
                    best = least
                    elements[i], coordinates[i] = order[slot], found
    return elements, coordinates
