"""Solids as implicit functions: negative inside, close to the Euclidean distance (mm) near the surface.

The smooth set operations are the polynomial ones (a quadratic blend over `blend` mm), which keep the
gradient close to one, so that the value can serve as a distance for partial volumes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core.arrays import FloatArray

Points = NDArray[Any]
"""Coordinates (..., 3) in mm; float32 for voxels, float64 for everything else."""

Distance = Callable[[Points], NDArray[Any]]
"""Signed distance (...) in mm of points (..., 3), negative inside."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A signed distance function and the box (2, 3), lowest and highest corner in mm, that holds its inside."""

    distance: Distance
    bounds: FloatArray


def ellipsoid(centre: ArrayLike, radii: ArrayLike, turn: ArrayLike | None = None) -> Solid:
    """Ellipsoid with semi-axes `radii` (3,) along the columns of the rotation `turn` (3, 3).

    The value is |q| (|q| − 1) / |q / r| with q = p / r: zero and of unit slope on the surface (and zero
    at the very centre, where it has no direction; no voxel or node lies exactly there).
    """
    middle, semi = np.asarray(centre, dtype=np.float64), np.asarray(radii, dtype=np.float64)
    axes = np.eye(3) if turn is None else np.asarray(turn, dtype=np.float64)

    def distance(points: Points) -> NDArray[Any]:
        local = points - middle.astype(points.dtype)
        if turn is not None:
            local = local @ axes.astype(points.dtype)
        scaled = local / semi.astype(points.dtype)
        first = length(scaled)
        second = np.maximum(length(scaled / semi.astype(points.dtype)), 1e-9)
        value: NDArray[Any] = first * (first - 1.0) / second
        return value

    # Half width of a turned ellipsoid along each axis of space.
    half = np.sqrt(((axes * semi) ** 2).sum(axis=1))
    return Solid(distance, np.array([middle - half, middle + half]))


def cone(start: ArrayLike, end: ArrayLike, start_radius: float, end_radius: float) -> Solid:
    """A straight piece of tube whose radius changes linearly, closed by round ends (mm)."""
    a, b = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    along = b - a
    squared = float(along @ along)

    def distance(points: Points) -> NDArray[Any]:
        offset = points - a.astype(points.dtype)
        where = np.clip(offset @ (along / squared).astype(points.dtype), 0.0, 1.0)
        offset -= where[..., None] * along.astype(points.dtype)
        radius = start_radius + where * (end_radius - start_radius)
        value: NDArray[Any] = length(offset) - radius
        return value

    low = np.minimum(a - start_radius, b - end_radius)
    return Solid(distance, np.array([low, np.maximum(a + start_radius, b + end_radius)]))


def length(vectors: NDArray[Any]) -> NDArray[Any]:
    """Euclidean length (...) of vectors (..., k)."""
    squared = vectors[..., 0] * vectors[..., 0]
    for axis in range(1, vectors.shape[-1]):
        squared += vectors[..., axis] * vectors[..., axis]
    result: NDArray[Any] = np.sqrt(squared)
    return result


def union(solids: list[Solid], blend: float = 0.0) -> Solid:
    """All solids together, the seams rounded over `blend` mm."""

    def distance(points: Points) -> NDArray[Any]:
        value = solids[0].distance(points)
        for solid in solids[1:]:
            value = smooth_minimum(value, solid.distance(points), blend)
        return value

    low = np.min([solid.bounds[0] for solid in solids], axis=0) - blend / 4.0
    high = np.max([solid.bounds[1] for solid in solids], axis=0) + blend / 4.0
    return Solid(distance, np.array([low, high]))


def difference(solid: Solid, cut: Solid, blend: float = 0.0) -> Solid:
    """`solid` without `cut`, the rim rounded over `blend` mm."""
    return Solid(lambda points: -smooth_minimum(-solid.distance(points), cut.distance(points), blend), solid.bounds)


def intersection(solid: Solid, other: Solid, blend: float = 0.0) -> Solid:
    """What both have in common, the rim rounded over `blend` mm."""
    bounds = np.array([np.maximum(solid.bounds[0], other.bounds[0]), np.minimum(solid.bounds[1], other.bounds[1])])
    return Solid(lambda points: -smooth_minimum(-solid.distance(points), -other.distance(points), blend), bounds)


def half_space(axis: int, limit: float, keep_below: bool) -> Solid:
    """Everything with coordinate `axis` below (or above) `limit` mm."""
    sign = 1.0 if keep_below else -1.0
    bounds = np.array([np.full(3, -1e4), np.full(3, 1e4)])
    bounds[1 if keep_below else 0, axis] = limit

    def distance(points: Points) -> NDArray[Any]:
        value: NDArray[Any] = sign * (points[..., axis] - limit)
        return value

    return Solid(distance, bounds)


def grown(solid: Solid, by_mm: float) -> Solid:
    """The solid with its surface moved outward by `by_mm`."""
    return Solid(lambda points: solid.distance(points) - by_mm, solid.bounds + np.array([[-by_mm], [by_mm]]))


def smooth_minimum(first: NDArray[Any], second: NDArray[Any], blend: float) -> NDArray[Any]:
    """Minimum of two distances, rounded where they differ by less than `blend` mm (quadratic polynomial)."""
    lower: NDArray[Any] = np.minimum(first, second)
    if blend > 0.0:
        near = np.maximum(blend - np.abs(first - second), 0.0) / blend
        lower = lower - near * near * (blend / 4.0)
    return lower


def gradient(solid: Solid, points: FloatArray, step_mm: float = 0.05) -> FloatArray:
    """Gradient (n, 3) of the distance at points (n, 3), by central differences."""
    steps = step_mm * np.eye(3)
    slopes = [(solid.distance(points + s) - solid.distance(points - s)) / (2.0 * step_mm) for s in steps]
    return np.stack(slopes, axis=-1)


def moved_inside(solid: Solid, point: ArrayLike, depth_mm: float) -> FloatArray:
    """The point (3,), moved along the distance's gradient until it is at least `depth_mm` inside."""
    place = np.array([point], dtype=np.float64)
    for _ in range(20):
        lacking = float(solid.distance(place)[0]) + depth_mm
        if lacking <= 1e-6:
            break
        slope = gradient(solid, place)
        place = place - lacking * slope / max(float((slope * slope).sum()), 1e-6)
    result: FloatArray = place[0]
    return result
