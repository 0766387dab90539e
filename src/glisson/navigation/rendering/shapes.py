"""Meshes of things that are known as lines, boxes or planes: vessels, wire, lever, board, resection plane."""

import numpy as np
from scipy.spatial import ConvexHull

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.structures import VesselTree
from glisson.core.tools import Lever

_SIDES = 14

Mesh = tuple[FloatArray, IntArray]
"""Vertices (n, 3) in mm and triangles (m, 3)."""


def tube(points_mm: FloatArray, radius_mm: float) -> Mesh:
    """A tube of constant radius along a polyline (n, 3), with round ends."""
    edges = np.stack([np.arange(len(points_mm) - 1), np.arange(1, len(points_mm))], axis=1)
    return network(points_mm, np.full(len(points_mm), radius_mm), edges)


def tree_tubes(tree: VesselTree, points_mm: FloatArray) -> Mesh:
    """Tubes along a vessel tree whose centreline points are now at `points_mm` (n, 3)."""
    return network(points_mm, tree.radii_mm, tree.edges)


def network(points_mm: FloatArray, radii_mm: FloatArray, edges: IntArray) -> Mesh:
    """Cones along edges (e, 2) and balls at the points, so that joints and ends are round."""
    steps = points_mm[edges[:, 1]] - points_mm[edges[:, 0]]
    length = np.linalg.norm(steps, axis=1)
    keep = length > 0.0
    edges, along = edges[keep], steps[keep] / length[keep, None]
    seed = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    u = np.cross(seed, along)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(along, u)
    angles = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    around = np.cos(angles)[None, :, None] * u[:, None] + np.sin(angles)[None, :, None] * v[:, None]
    rings = [points_mm[edges[:, end]][:, None] + radii_mm[edges[:, end]][:, None, None] * around for end in (0, 1)]
    vertices = np.concatenate(rings, axis=1).reshape(-1, 3)
    ring, turned = np.arange(_SIDES), (np.arange(_SIDES) + 1) % _SIDES
    quads = np.concatenate(
        [np.stack([ring, turned, ring + _SIDES], axis=1), np.stack([turned, turned + _SIDES, ring + _SIDES], axis=1)]
    )
    walls = (quads[None] + 2 * _SIDES * np.arange(len(edges))[:, None, None]).reshape(-1, 3)
    ball, ball_triangles = _unit_ball(1)
    used = np.unique(edges)
    balls = (points_mm[used][:, None] + radii_mm[used][:, None, None] * ball[None]).reshape(-1, 3)
    shifted = (ball_triangles[None] + len(ball) * np.arange(len(used))[:, None, None]).reshape(-1, 3)
    return np.vstack([vertices, balls]), np.vstack([walls, shifted + len(vertices)])


def lever_bar(lever: Lever, angle_deg: float) -> Mesh:
    """The lever's bar with its rounded edges, turned to an angle about its hinge."""
    half = np.array([lever.length_mm, lever.width_mm, lever.thickness_mm]) / 2.0
    ball, _ = _unit_ball(2)
    signs = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    corners = signs * (half - lever.edge_radius_mm)
    local = (corners[:, None] + lever.edge_radius_mm * ball[None]).reshape(-1, 3)
    triangles = _outward(local, ConvexHull(local).simplices.astype(np.int64))
    local = local + np.array([half[0], 0.0, -half[2]])
    angle = np.radians(angle_deg)
    arm = np.cos(angle) * lever.arm + np.sin(angle) * lever.up
    top = np.cos(angle) * lever.up - np.sin(angle) * lever.arm
    return lever.hinge_mm + local @ np.stack([arm, -lever.axis, top]), triangles


def patch(centre: FloatArray, u: FloatArray, v: FloatArray, steps: int = 2) -> Mesh:
    """A flat parallelogram centre ± u ± v (half edges (3,) in mm) of `steps`² squares."""
    line = np.linspace(-1.0, 1.0, steps + 1)
    a, b = np.meshgrid(line, line, indexing="ij")
    vertices = centre + a.reshape(-1, 1) * u + b.reshape(-1, 1) * v
    index = np.arange((steps + 1) ** 2).reshape(steps + 1, steps + 1)
    p, q, r, s = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    return vertices, np.vstack([np.stack([p, q, r], axis=1), np.stack([p, r, s], axis=1)])


def _outward(vertices: FloatArray, triangles: IntArray) -> IntArray:
    a, b, c = (vertices[triangles[:, corner]] for corner in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), a - vertices.mean(axis=0)) < 0.0
    return np.where(inward[:, None], triangles[:, [0, 2, 1]], triangles)


def _unit_ball(level: int) -> Mesh:
    """An octahedron refined `level` times, on the unit sphere."""
    vertices = np.vstack([np.eye(3), -np.eye(3)])
    triangles = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    for _ in range(level):
        middles = np.concatenate([vertices[triangles[:, i]] + vertices[triangles[:, (i + 1) % 3]] for i in range(3)])
        ab, bc, ca = np.arange(3 * len(triangles)).reshape(3, -1) + len(vertices)
        vertices = np.vstack([vertices, middles / np.linalg.norm(middles, axis=1, keepdims=True)])
        a, b, c = triangles.T
        triangles = np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3)
    return vertices, triangles
