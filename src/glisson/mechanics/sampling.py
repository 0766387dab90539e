"""How densely the organ's surface is sampled for contact: a tool's rounded edge must not pass between the points."""

from collections.abc import Sequence

import numpy as np

from glisson.core.arrays import IntArray
from glisson.core.mesh import TetMesh
from glisson.mechanics.tools import LeverTool, RigidTool

_PARTS = 2  # of every side of a face, where no moving tool is near
_REACH_MM = 30.0  # how far the surface may slide on a lever
_SPACING_RADII = 0.3
"""Largest distance of points, in radii of a tool's edge.

Midway between points that touch an edge of radius R, s apart, the surface lies s² / 8R deeper: 0.03 mm for 3 mm.
"""


def face_parts(mesh: TetMesh, tools: Sequence[RigidTool]) -> IntArray:
    """In how many parts the sides of the boundary's faces (f,) are cut for `surface_quadrature`."""
    triangles, _ = mesh.boundary()
    corners = mesh.nodes[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.full(len(triangles), _PARTS)
    for tool in tools:
        if isinstance(tool, LeverTool):
            rotation, translation = tool.pose(0.0)
            distances = tool.distance((corners.reshape(-1, 3) - translation) @ rotation)
            near = distances.reshape(-1, 3).min(axis=1) < _REACH_MM
            # Points lie half a small side apart.
            wanted = np.ceil(longest / (2.0 * _SPACING_RADII * tool.lever.edge_radius_mm)).astype(np.int64)
            parts = np.where(near, np.maximum(parts, wanted), parts)
    return parts
