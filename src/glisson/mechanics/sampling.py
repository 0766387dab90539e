"""How densely the organ's surface is sampled for contact: a tool's rounded edge must not pass between the points."""

from collections.abc import Sequence
from copy import copy

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.scenario import Stage
from glisson.mechanics.carried_tool import CarriedTool
from glisson.mechanics.tools import RigidTool

_PARTS = 2  # of every side of a face, where no moving tool is near
_STATIONS = 5  # on a tool's way in a stage
_REACH_MM = 30.0  # how far the surface may slide on a lever
_SPACING_RADII = 0.3
"""Largest distance of points, in radii of a tool's edge.

Midway between points that touch an edge of radius R, s apart, the surface lies s² / 8R deeper: 0.03 mm for 3 mm.
"""


def face_parts(mesh: TetMesh, tools: Sequence[RigidTool], stages: Sequence[Stage] = ()) -> IntArray:
    """In how many parts the sides of the boundary's faces (f,) are cut for `surface_quadrature`.

    They are cut finely where an edge of a tool is near, or comes near in one of the stages.
    """
    triangles, _ = mesh.boundary()
    corners = mesh.nodes[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    parts = np.full(len(triangles), _PARTS)
    for tool in tools:
        if tool.edge_radius_mm is None:
            continue
        near = np.zeros(len(triangles), dtype=bool)
        for rotation, translation in _stations(tool, stages):
            distances = tool.distance((corners.reshape(-1, 3) - translation) @ rotation)
            near |= distances.reshape(-1, 3).min(axis=1) < _REACH_MM
        # Points lie half a small side apart.
        wanted = np.ceil(longest / (2.0 * _SPACING_RADII * tool.edge_radius_mm)).astype(np.int64)
        parts = np.where(near, np.maximum(parts, wanted), parts)
    return parts


def _stations(tool: RigidTool, stages: Sequence[Stage]) -> list[tuple[FloatArray, FloatArray]]:
    """Poses from which a tool reaches the surface: at the start, and on the way that stages carry it."""
    poses, angle = [tool.pose(0.0)], 0.0
    if isinstance(tool, CarriedTool):
        walker = copy(tool)
        for stage in stages:
            for motion in stage.motions:
                if motion.tool == tool.name:
                    goal = walker.set_out(angle, motion)
                    poses += [walker.pose(float(way)) for way in np.linspace(angle, goal, _STATIONS)[1:]]
                    angle = goal
    return poses
