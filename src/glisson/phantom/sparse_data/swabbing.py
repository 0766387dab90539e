"""What of a deformed liver is swabbed: a continuous part of its visible front in strokes, and named features."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray, IntArray, unit_vector
from glisson.core.mesh import TriangleSurface
from glisson.core.structures import Curve
from glisson.geometry.normals import vertex_normals
from glisson.phantom.sparse_data.liver import FALCIFORM, SparseLiver

STROKE_MM, STEP_MM = 9.0, 4.0
"""Distance between strokes as the viewer sees them, and between points along one."""

_WIDTH_MM, _DENSITY = 1.2, 4.0
"""A stroke is made of points of a band of this width, of which so many for each that stays are drawn first."""

_WAVER_MM, _WAVER_LENGTH_MM = 2.5, 14.0
_FEATURE_STEP_MM = 4.0
_VIEW_TILT_DEG = 10.0
_FACING = 0.1
"""Seen is what faces the viewer by a cosine of so much."""

_RAGGED, _RAGGED_MM = 0.6, 45.0
"""How uneven the outline is: paths are longer or shorter by e to this, over such lengths."""

_START_MM = 55.0
"""A surgeon begins within so much of the notch, where the falciform ligament meets the lower margin."""

_FEATURE_REACH_MM = 60.0
_LEAST_FEATURE_POINTS = 4


@dataclass(frozen=True, eq=False)
class Swab:
    """Material points of A (mm) that were touched: `front` (n, 3), and of each feature (k, 3).

    `covered` (v,) says which of the surface's vertices the swabbed part has, `coverage` their share of its whole area.
    """

    front: FloatArray
    features: Mapping[str, FloatArray]
    covered: NDArray[np.bool_]
    coverage: float


def swab(liver: SparseLiver, deformed: FloatArray, coverage: float, random: np.random.Generator) -> Swab:
    """Swab that share of the surface's area.

    Args:
        liver: in A.
        deformed: where the vertices of its surface are (v, 3).
        coverage: share of the area.
        random: draws view, outline and strokes.
    """
    surface = liver.surface
    view = _view(random)
    facing = vertex_normals(deformed, surface.triangles) @ view
    areas = vertex_areas(surface)
    away = _path_lengths(surface, facing > _FACING, liver.features[FALCIFORM].points_mm[0], random)
    order = np.argsort(away, kind="stable")
    count = int(np.searchsorted(np.cumsum(areas[order]), coverage * areas.sum()))
    covered = np.zeros(len(areas), dtype=bool)
    covered[order[:count]] = np.isfinite(away[order[:count]])
    near = cKDTree(surface.vertices[covered])
    features = {}
    for name, curve in liver.features.items():
        points = evenly_along(curve, _FEATURE_STEP_MM)
        reached = points[near.query(points)[0] < _FEATURE_REACH_MM]
        if len(reached) >= _LEAST_FEATURE_POINTS:
            features[name] = reached
    front = _strokes(surface, covered, view, random)
    return Swab(front, features, covered, float(areas[covered].sum() / areas.sum()))


def evenly_along(curve: Curve, step_mm: float) -> FloatArray:
    """Points (n, 3) along a curve, that far from one another."""
    places = np.arange(0.5 * step_mm, curve.length_mm, step_mm)
    return np.stack([np.interp(places, curve.arc_lengths_mm, axis) for axis in curve.points_mm.T], axis=1)


def vertex_areas(surface: TriangleSurface) -> FloatArray:
    """A third of the triangles around each vertex (v,) in mm²."""
    areas: FloatArray = np.zeros(len(surface.vertices))
    np.add.at(areas, surface.triangles, surface.triangle_areas_mm2[:, None] / 3.0)
    return areas


def thinned(points: FloatArray, apart_mm: float) -> IntArray:
    """Numbers of points (n, 3) of which no two are closer than that, the first ones first."""
    pairs = cKDTree(points).query_pairs(apart_mm, output_type="ndarray")
    later: list[list[int]] = [[] for _ in points]
    for one, other in pairs:
        later[one].append(other)
    left = np.ones(len(points), dtype=bool)
    for number in range(len(points)):
        if left[number]:
            left[later[number]] = False
    return np.flatnonzero(left)


def _view(random: np.random.Generator) -> FloatArray:
    """Unit vector (3,) towards the viewer: in front of the patient, somewhat to a side."""
    side = np.tan(np.radians(_VIEW_TILT_DEG)) * random.uniform(-1.0, 1.0, size=2)
    return unit_vector([side[0], -1.0, side[1]], "view")


def _path_lengths(
    surface: TriangleSurface, seen: NDArray[np.bool_], notch: FloatArray, random: np.random.Generator
) -> FloatArray:
    """Length (v,) of the shortest path over what is seen from a start near the `notch` (3,); infinite elsewhere.

    Lengths are stretched unevenly, so that what is within a length has no round outline; it always is continuous.
    """
    points = surface.vertices
    edges = np.unique(np.sort(surface.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    edges = edges[seen[edges].all(axis=1)]
    waves = random.normal(size=(6, 3)) / _RAGGED_MM
    uneven = np.cos(points @ waves.T + random.uniform(0.0, 2.0 * np.pi, size=6)).sum(axis=1) / np.sqrt(3.0)
    stretch = np.exp(_RAGGED * uneven[edges].mean(axis=1))
    lengths = stretch * np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    graph = coo_array((lengths, (edges[:, 0], edges[:, 1])), shape=(len(points),) * 2).tocsr()
    _, parts = connected_components(graph, directed=False)
    largest = parts == np.bincount(parts).argmax()
    starts = np.flatnonzero(largest & (np.linalg.norm(points - notch, axis=1) < _START_MM))
    found: FloatArray = dijkstra(graph, directed=False, indices=int(random.choice(starts)))
    return found


def _strokes(
    surface: TriangleSurface, covered: NDArray[np.bool_], view: FloatArray, random: np.random.Generator
) -> FloatArray:
    """Points (n, 3) along wavering strokes over the covered triangles, some of A."""
    triangles = surface.triangles[covered[surface.triangles].all(axis=1)]
    corners = surface.vertices[triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(sides, axis=1)
    dense = int(_DENSITY * areas.sum() / (STEP_MM * _WIDTH_MM))
    which = random.choice(len(areas), size=dense, p=areas / areas.sum())
    points = np.einsum("nc,ncd->nd", random.dirichlet(np.ones(3), size=len(which)), corners[which])
    along = np.cross(view, random.normal(size=3))
    along /= np.linalg.norm(along)
    across = np.cross(view, along)
    phases = random.uniform(0.0, 2.0 * np.pi, size=2)
    wavering = points @ across + _WAVER_MM * np.sin(points @ along / _WAVER_LENGTH_MM + phases[0])
    beside = np.abs((wavering / STROKE_MM + phases[1] + 0.5) % 1.0 - 0.5) * STROKE_MM
    on: FloatArray = points[beside < 0.5 * _WIDTH_MM]
    kept: FloatArray = on[thinned(on, STEP_MM)]
    return kept
