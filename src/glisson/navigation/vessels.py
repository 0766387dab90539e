"""Vessels that the resection plane crosses, with their diameters."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.guidance import CrossedVessel
from glisson.core.structures import Plane, VesselTree
from glisson.geometry.mapping import PointMap

_STEP_MM = 2.0
_AT_SURFACE_MM = 1.0
"""A crossing this far outside the mesh still counts as inside: meshes smooth the surface a little."""


def crossed_vessels(trees: tuple[VesselTree, ...], plane: Plane, point_map: PointMap) -> tuple[CrossedVessel, ...]:
    """Crossings of carried centrelines with a plane in B, inside the organ, thickest first.

    The diameter is interpolated along the centreline in A. Crossings of one tree whose lumens overlap on
    the plane are one hole in the cut surface and are told once, by the thickest.
    """
    found = [crossing for tree in trees for crossing in _crossings(tree, plane, point_map)]
    return tuple(sorted(found, key=lambda vessel: -vessel.diameter_mm))


def _crossings(tree: VesselTree, plane: Plane, point_map: PointMap) -> list[CrossedVessel]:
    if len(tree.edges) == 0:
        return []
    points, radii, edges = _refined(tree)
    places = point_map.forward(points)
    heights = plane.distance_mm(places)[edges]
    cut = np.flatnonzero((heights[:, 0] > 0.0) != (heights[:, 1] > 0.0))
    share = (heights[cut, 0] / (heights[cut, 0] - heights[cut, 1]))[:, None]
    in_a = (1.0 - share) * points[edges[cut, 0]] + share * points[edges[cut, 1]]
    in_b = (1.0 - share) * places[edges[cut, 0]] + share * places[edges[cut, 1]]
    radius = ((1.0 - share) * radii[edges[cut, 0], None] + share * radii[edges[cut, 1], None])[:, 0]
    inside = point_map.locate(in_a).distance_mm <= _AT_SURFACE_MM
    kept: list[int] = []
    for row in np.argsort(-radius):
        apart = np.linalg.norm(in_b[kept] - in_b[row], axis=1)
        if inside[row] and np.all(apart > radius[kept] + radius[row]):
            kept.append(int(row))
    return [
        CrossedVessel(
            tree.name, 2.0 * float(radius[row]), (float(in_a[row, 0]), float(in_a[row, 1]), float(in_a[row, 2]))
        )
        for row in kept
    ]


def _refined(tree: VesselTree) -> tuple[FloatArray, FloatArray, IntArray]:
    """Points, radii and edges with every edge cut into pieces of at most 2 mm, so that they can bend."""
    points, radii, edges = [tree.points_mm], [tree.radii_mm], []
    count = len(tree.points_mm)
    for start, end in tree.edges:
        length = float(np.linalg.norm(tree.points_mm[end] - tree.points_mm[start]))
        inner = max(int(np.ceil(length / _STEP_MM)) - 1, 0)
        share = np.arange(1, inner + 1)[:, None] / (inner + 1)
        points.append((1.0 - share) * tree.points_mm[start] + share * tree.points_mm[end])
        radii.append((1.0 - share[:, 0]) * tree.radii_mm[start] + share[:, 0] * tree.radii_mm[end])
        chain = np.array([start, *range(count, count + inner), end])
        edges.append(np.stack([chain[:-1], chain[1:]], axis=1))
        count += inner
    return np.vstack(points), np.concatenate(radii), np.vstack(edges)
