"""Distance of points to a triangle surface, and whether points lie inside it."""

from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TriangleSurface
from glisson.geometry.box_tree import STACK_SIZE, build_box_tree, refitted, squared_distance_to_box
from glisson.geometry.compiled import compiled


@dataclass(frozen=True, eq=False)
class NearestTriangles:
    """For each of n points: distance (n,) mm, closest point (n, 3) mm, triangle (n,), its barycentric (n, 3)."""

    distance_mm: FloatArray
    closest_mm: FloatArray
    triangles: IntArray
    barycentric: FloatArray


class SurfaceTree:
    """A triangle surface prepared for many distance and inside queries."""

    def __init__(self, vertices: FloatArray, triangles: IntArray) -> None:
        """Prepare triangles (m, 3) over vertices (n, 3) in mm.

        Raises:
            BadInput: there is no triangle.
        """
        if len(triangles) == 0:
            raise BadInput("A surface without triangles has no distance to anything; give one triangle at least.")
        self.triangles = triangles
        """(m, 3) in vertex numbers."""
        self._corners = np.ascontiguousarray(vertices[triangles])
        self._tree = build_box_tree(self._corners.min(axis=1), self._corners.max(axis=1))

    def moved(self, vertices: FloatArray) -> "SurfaceTree":
        """The same triangles with their vertices (n, 3) elsewhere, much quicker than a new tree and as exact."""
        other = copy(self)
        other._corners = np.ascontiguousarray(vertices[self.triangles])
        other._tree = refitted(self._tree, other._corners)
        return other

    def nearest(self, points_mm: ArrayLike) -> NearestTriangles:
        """The nearest triangle of each point (n, 3), exactly."""
        points = _as_points(points_mm)
        return NearestTriangles(*_nearest(points, self._corners, *self._tree))

    def contains(self, points_mm: ArrayLike) -> NDArray[np.bool_]:
        """Whether points (n, 3) lie inside the (closed) surface: winding number of a vertical ray, (n,)."""
        points = _as_points(points_mm)
        return np.asarray(_windings(points, self._corners, *self._tree) != 0)


def closest_points(points: ArrayLike, surface: TriangleSurface) -> tuple[FloatArray, FloatArray]:
    """Unsigned distance (n,) in mm of points (n, 3), and the closest points (n, 3), on a surface."""
    nearest = SurfaceTree(surface.vertices, surface.triangles).nearest(points)
    return nearest.distance_mm, nearest.closest_mm


def inside(points: ArrayLike, surface: TriangleSurface) -> NDArray[np.bool_]:
    """Whether points (n, 3) in mm lie inside a closed surface, (n,).

    Exact up to the rounding of the height of the surface above a point: neighbouring triangles share
    their edges under one half-open rule, so no ray slips between them or counts twice.

    Raises:
        BadInput: the surface is not closed.
    """
    if not surface.is_closed:
        raise BadInput("Inside and outside need a closed surface; this one has open or doubly used edges.")
    return SurfaceTree(surface.vertices, surface.triangles).contains(points)


def _as_points(points: ArrayLike) -> FloatArray:
    return np.ascontiguousarray(np.asarray(points, dtype=np.float64).reshape(-1, 3))


@compiled
def _product(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> float:
    """(b − a) · (d − c), without an array being made: this is where the time goes."""
    return float((b[0] - a[0]) * (d[0] - c[0]) + (b[1] - a[1]) * (d[1] - c[1]) + (b[2] - a[2]) * (d[2] - c[2]))


@compiled
def _closest_barycentric(p: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> tuple[float, float, float]:
    """Barycentric coordinates of the point of triangle abc closest to p (Ericson 2005, section 5.1.5)."""
    d1, d2 = _product(a, b, a, p), _product(a, c, a, p)
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    d3, d4 = _product(a, b, b, p), _product(a, c, b, p)
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0 and d1 > d3:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    d5, d6 = _product(a, b, c, p), _product(a, c, c, p)
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0 and d2 > d6:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0 and d4 - d3 + d5 - d6 > 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - w, w
    total = va + vb + vc
    if total <= 0.0:  # all three corners on a line, which its longest edge covers
        return _closest_on_longest_edge(p, a, b, c)
    return va / total, vb / total, vc / total


@compiled
def _closest_on_longest_edge(p: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> tuple[float, float, float]:
    ab, bc, ca = np.sum((b - a) ** 2), np.sum((c - b) ** 2), np.sum((a - c) ** 2)
    if ab >= bc and ab >= ca:
        t = _along(p, a, b, ab)
        return 1.0 - t, t, 0.0
    if bc >= ca:
        t = _along(p, b, c, bc)
        return 0.0, 1.0 - t, t
    t = _along(p, c, a, ca)
    return t, 0.0, 1.0 - t


@compiled
def _along(p: FloatArray, a: FloatArray, b: FloatArray, squared: float) -> float:
    """Place 0 to 1 on the edge a → b, of this squared length, closest to p."""
    if squared == 0.0:
        return 0.0
    return float(min(max(np.dot(p - a, b - a) / squared, 0.0), 1.0))


@compiled
def _nearest(
    points: FloatArray,
    corners: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    left: IntArray,
    first: IntArray,
    count: IntArray,
    order: IntArray,
) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
    number = len(points)
    distance, closest = np.zeros(number), np.zeros((number, 3))
    triangles, barycentric = np.zeros(number, dtype=np.int64), np.zeros((number, 3))
    stack = np.zeros(STACK_SIZE, dtype=np.int64)
    for i in range(number):
        p, best = points[i], np.inf
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            if squared_distance_to_box(p, lower[node], upper[node]) >= best:
                continue
            if left[node] >= 0:
                near, far = left[node], left[node] + 1
                if squared_distance_to_box(p, lower[far], upper[far]) < squared_distance_to_box(
                    p, lower[near], upper[near]
                ):
                    near, far = far, near
                stack[top], stack[top + 1] = far, near
                top += 2
                continue
            for slot in range(first[node], first[node] + count[node]):
                a, b, c = corners[order[slot], 0], corners[order[slot], 1], corners[order[slot], 2]
                u, v, w = _closest_barycentric(p, a, b, c)
                x = u * a[0] + v * b[0] + w * c[0]
                y = u * a[1] + v * b[1] + w * c[1]
                z = u * a[2] + v * b[2] + w * c[2]
                squared = (p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2
                if squared < best:
                    best = squared
                    closest[i, 0], closest[i, 1], closest[i, 2], triangles[i] = x, y, z, order[slot]
                    barycentric[i, 0], barycentric[i, 1], barycentric[i, 2] = u, v, w
        distance[i] = np.sqrt(best)
    return distance, closest, triangles, barycentric


@compiled
def _edge_side(ax: float, ay: float, bx: float, by: float) -> float:
    """Side of the origin seen from the edge a → b: ±1, never 0, and opposite for b → a."""
    area = ax * by - ay * bx
    if area == 0.0:
        # The ray meets the edge exactly: give it to one of both neighbours, whichever the edge's direction says.
        return 1.0 if (by > ay or (by == ay and bx < ax)) else -1.0
    return 1.0 if area > 0.0 else -1.0


@compiled
def _crossing(p: FloatArray, a: FloatArray, b: FloatArray, c: FloatArray) -> int:
    """+1 or −1 when the ray from p towards +z crosses triangle abc upward or downward, else 0."""
    ax, ay, bx, by, cx, cy = a[0] - p[0], a[1] - p[1], b[0] - p[0], b[1] - p[1], c[0] - p[0], c[1] - p[1]
    side = _edge_side(ax, ay, bx, by)
    if _edge_side(bx, by, cx, cy) != side or _edge_side(cx, cy, ax, ay) != side:
        return 0
    wa, wb, wc = bx * cy - by * cx, cx * ay - cy * ax, ax * by - ay * bx
    total = wa + wb + wc
    if total == 0.0:
        return 0
    height = (wa * (a[2] - p[2]) + wb * (b[2] - p[2]) + wc * (c[2] - p[2])) / total
    if height <= 0.0:
        return 0
    return 1 if side > 0.0 else -1


@compiled
def _windings(
    points: FloatArray,
    corners: FloatArray,
    lower: FloatArray,
    upper: FloatArray,
    left: IntArray,
    first: IntArray,
    count: IntArray,
    order: IntArray,
) -> IntArray:
    result = np.zeros(len(points), dtype=np.int64)
    stack = np.zeros(STACK_SIZE, dtype=np.int64)
    for i in range(len(points)):
        p = points[i]
        stack[0], top = 0, 1
        while top > 0:
            top -= 1
            node = stack[top]
            low, high = lower[node], upper[node]
            if p[2] > high[2] or p[0] < low[0] or p[0] > high[0] or p[1] < low[1] or p[1] > high[1]:
                continue
            if left[node] >= 0:
                stack[top], stack[top + 1] = left[node], left[node] + 1
                top += 2
                continue
            for slot in range(first[node], first[node] + count[node]):
                body = order[slot]
                result[i] += _crossing(p, corners[body, 0], corners[body, 1], corners[body, 2])
    return result
