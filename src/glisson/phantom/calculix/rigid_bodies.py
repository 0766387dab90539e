"""Board and lever as elements for CalculiX: all their nodes are prescribed, so only their faces matter."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.tools import Lever

_EDGE_ANGLES = np.deg2rad([45.0, 30.0, 15.0, 0.0])


def lever_mesh(lever: Lever, longest_mm: float = 12.0) -> TetMesh:
    """The lever at angle 0 as tetrahedra from its centre to its rounded surface (element m's face is 0-1-2).

    The surface is that of a box whose points are drawn back to an inner box and pushed out by the edge
    radius, so edges and corners are round.
    """
    half = np.array([lever.length_mm, lever.thickness_mm, lever.width_mm]) / 2.0
    knots = [_knots(h, lever.edge_radius_mm, longest_mm) for h in half]
    points, triangles = _box_surface(knots)
    inner = np.clip(points, -(half - lever.edge_radius_mm), half - lever.edge_radius_mm)
    outward = points - inner
    rounded = inner + lever.edge_radius_mm * outward / np.linalg.norm(outward, axis=1, keepdims=True)
    axes = np.stack([lever.arm, lever.up, np.cross(lever.arm, lever.up)])
    centre = lever.hinge_mm + half[0] * lever.arm - half[1] * lever.up
    nodes = np.vstack([rounded @ axes + centre, centre])
    apex = np.full((len(triangles), 1), len(points))
    # The centre lies behind the outward triangle; turned round, the tetrahedron is positive.
    return TetMesh(nodes, np.hstack([triangles[:, ::-1], apex]))


def board_panels(
    centre: FloatArray, normal: FloatArray, half_width_mm: float, panels: int
) -> tuple[FloatArray, IntArray]:
    """A square board as panels × panels C3D8 bricks 10 mm thick; the organ's side is their face S2.

    Returns nodes (n, 3) and bricks (m, 8).
    """
    first = np.cross(normal, [0.0, 0.0, 1.0] if abs(normal[2]) < 0.9 else [1.0, 0.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    steps = np.linspace(-half_width_mm, half_width_mm, panels + 1)
    a, b = np.meshgrid(steps, steps, indexing="ij")
    top = centre + a.reshape(-1, 1) * first + b.reshape(-1, 1) * second
    nodes = np.vstack([top - 10.0 * normal, top])
    count = panels + 1
    corner = (np.arange(panels)[:, None] * count + np.arange(panels)).reshape(-1)
    below = np.stack([corner, corner + count, corner + count + 1, corner + 1], axis=1)
    return nodes, np.hstack([below, below + count * count])


def turned(points: FloatArray, lever: Lever, angle_rad: float) -> FloatArray:
    """Points (n, 3) of the lever after it has turned by an angle about its hinge (Rodrigues)."""
    offset = points - lever.hinge_mm
    axis = lever.axis
    along = np.outer(offset @ axis, axis)
    across = offset - along
    swung = np.cos(angle_rad) * across + np.sin(angle_rad) * np.cross(axis, across)
    result: FloatArray = lever.hinge_mm + along + swung
    return result


def _knots(half: float, radius: float, longest: float) -> FloatArray:
    """Coordinates along one edge of the box: fine at the rounded ends, at most `longest` apart between."""
    ends = (half - radius) + radius * np.tan(_EDGE_ANGLES)
    flat = half - radius
    middle = np.linspace(-flat, flat, max(1, int(np.ceil(2.0 * flat / longest))) + 1) if flat > 1e-9 else np.zeros(1)
    return np.unique(np.round(np.concatenate([-ends, middle, ends]), 9))


def _box_surface(knots: list[FloatArray]) -> tuple[FloatArray, IntArray]:
    """Points (n, 3) and outward triangles (m, 3) of the surface of a box with these coordinates."""
    points: list[FloatArray] = []
    triangles: list[IntArray] = []
    offset = 0
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        rows, columns = len(knots[u]), len(knots[v])
        grid = np.arange(rows * columns).reshape(rows, columns)
        corners = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
        both = np.vstack([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
        for side, turned_round in ((-1, True), (0, False)):
            face = np.zeros((rows * columns, 3))
            face[:, u], face[:, v] = np.repeat(knots[u], columns), np.tile(knots[v], rows)
            face[:, axis] = knots[axis][-1] if side == -1 else knots[axis][0]
            points.append(face)
            triangles.append((both if turned_round else both[:, ::-1]) + offset)
            offset += rows * columns
    every = np.round(np.vstack(points), 9).astype(np.float64)
    merged, index = np.unique(every, axis=0, return_inverse=True)
    return merged, index.reshape(-1)[np.vstack(triangles)]
