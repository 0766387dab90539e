"""Vessel trees of the phantom family in which no vessel passes through a thicker one, for tests that tell them apart.

The family grows its two systems without regard to each other, so that twigs run through trunks; a liver's do not. Here
a branch ends where it would, with all that comes from it.
"""

import numpy as np
from scipy.spatial import cKDTree

from glisson.core import Grid
from glisson.core.structures import VesselTree
from glisson.phantom.canvas import Canvas, voxel_places
from glisson.phantom.family import build_anatomy

_OVERLAP_MM = 0.5
_NEIGHBOURS = 40


def systems_apart(seed):
    """Portal and hepatic tree of a member of the family."""
    interior = build_anatomy(seed).interior
    return _apart(interior.portal, interior.hepatic), _apart(interior.hepatic, interior.portal)


def vessel_mask(trees, spacing_mm):
    """Mask [i, j, k] of trees and its grid."""
    points = np.concatenate([tree.points_mm for tree in trees])
    low, high = points.min(axis=0) - 9.0, points.max(axis=0) + 9.0
    grid = Grid(tuple(int(n) for n in np.ceil((high - low) / spacing_mm)), [spacing_mm] * 3, low)
    canvas = Canvas(grid, np.zeros(grid.shape, dtype=np.float32), voxel_places(grid), 0.0)
    return np.logical_or.reduce([canvas.paint_tree(tree, 1.0) for tree in trees]), grid


def depth_mm(tree, points):
    """Signed distance of points (n, 3) from a tree's wall, negative inside."""
    starts, ends = tree.points_mm[tree.edges[:, 0]], tree.points_mm[tree.edges[:, 1]]
    least = np.full(len(points), np.inf)
    for (a, b), start, end in zip(tree.edges, starts, ends, strict=True):
        along = end - start
        t = np.clip((points - start) @ along / max(along @ along, 1e-9), 0.0, 1.0)
        radius = (1.0 - t) * tree.radii_mm[a] + t * tree.radii_mm[b]
        least = np.minimum(least, np.linalg.norm(points - start - t[:, None] * along, axis=1) - radius)
    return least


def _sampled(tree):
    t = np.linspace(0.0, 1.0, 7)[:, None]
    first, last = tree.edges.T
    points = tree.points_mm[first][:, None] * (1.0 - t) + tree.points_mm[last][:, None] * t
    radii = tree.radii_mm[first][:, None] * (1.0 - t.T) + tree.radii_mm[last][:, None] * t.T
    return points, radii


def _apart(tree, other):
    (points, radii), (obstacles, widths) = _sampled(tree), _sampled(other)
    apart, near = cKDTree(obstacles.reshape(-1, 3)).query(points.reshape(-1, 3), _NEIGHBOURS)
    wide, own = widths.ravel()[near], radii.reshape(-1, 1)
    passes = ((own + wide - apart > _OVERLAP_MM) & (wide >= own)).any(axis=1).reshape(radii.shape).any(axis=1)
    gone = np.zeros(len(tree.points_mm), dtype=bool)
    for (parent, child), ends in zip(tree.edges, passes, strict=True):
        gone[child] = ends or gone[parent]
    edges = np.array([edge for edge in tree.edges if not gone[edge[1]]])
    return VesselTree(tree.name, tree.points_mm, tree.radii_mm, edges)
