"""Rigid tools as triangles."""

from math import radians

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TriangleSurface
from glisson.core.tools import Board, Lever
from glisson.geometry.boxes import box_mesh

_ARCS = 16  # chords to a quarter of a circle
_BOARD_MM = 1200.0
_BOARD_DEPTH_MM = 100.0


def lever_surface(lever: Lever, angle_deg: float, inset_mm: float = 0.0) -> tuple[TriangleSurface, float]:
    """The rounded box of a lever turned by an angle, its surface `inset_mm` further inside, and the chord error.

    The convex hull of spheres at the corners lies inside the box; their Hausdorff distance is the largest
    difference of their support functions, which convex bodies take at a normal of the hull.
    """
    radius = lever.edge_radius_mm - inset_mm
    half = np.array([lever.length_mm, lever.thickness_mm, lever.width_mm]) / 2.0
    inner = half - lever.edge_radius_mm
    angles = np.linspace(0.0, np.pi / 2.0, _ARCS + 1)
    polar, around = (a.ravel() for a in np.meshgrid(angles, angles, indexing="ij"))
    octant = np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=1)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    corners = (signs[:, None] * (inner + radius * octant)).reshape(-1, 3)
    hull = ConvexHull(np.unique(corners.round(12), axis=0))
    normals = hull.equations[:, :3]
    chord = (np.abs(normals) @ inner + radius + hull.equations[:, 3]).max()
    a, b, c = (hull.points[hull.simplices[:, n]] for n in range(3))
    inward = np.einsum("fi,fi->f", np.cross(b - a, c - a), normals) < 0.0
    triangles = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices)
    axes = np.stack([lever.arm, lever.up, np.cross(lever.arm, lever.up)], axis=1)
    flat = (hull.points + [half[0], -half[1], 0.0]) @ axes.T  # the hinge lies at the start of the top face
    turned = Rotation.from_rotvec(radians(angle_deg) * lever.axis).apply(flat)
    return TriangleSurface(turned + lever.hinge_mm, triangles), float(chord)


def board_surface(board: Board) -> TriangleSurface:
    """A board without a slot as a large box under its face."""
    box = box_mesh((_BOARD_MM, _BOARD_MM, _BOARD_DEPTH_MM), (1, 1, 1)).surface()
    places = box.vertices - [0.5 * _BOARD_MM, 0.5 * _BOARD_MM, _BOARD_DEPTH_MM]
    return TriangleSurface(places @ _frame(board.normal) + board.point_mm, box.triangles)


def _frame(normal: FloatArray) -> FloatArray:
    """Three unit vectors as rows, right-handed, the last of which is the normal."""
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    first = first / np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first), normal])
