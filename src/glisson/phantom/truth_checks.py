"""Is a deformed truth sound? Jacobians, what the tumour did, and how deep the organ sinks into the tools."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh
from glisson.core.structures import Tumour
from glisson.core.tools import Board, Lever
from glisson.geometry.mapping import PointMap
from glisson.geometry.quadratic import straight_boundary
from glisson.geometry.shape_functions import shape_slopes

# Barycentric coordinates of the four integration points of C3D10.
_NEAR, _FAR = 0.5854101966249685, 0.1381966011250105
GAUSS_POINTS = np.full((4, 4), _FAR) + (_NEAR - _FAR) * np.eye(4)


@dataclass(frozen=True)
class TumourMotion:
    """How far a tumour's centroid moved (mm), and its volume after over before."""

    moved_mm: float
    volume_ratio: float


def smallest_jacobian(mesh: TetMesh, nodes: FloatArray) -> float:
    """Smallest determinant of the map from the straight element to T10 elements at `nodes` (N, 3).

    Taken at the integration points, relative to the straight element of `mesh`: 1 at rest, 0 where an
    element is flat.
    """
    return float(_relative_jacobians(mesh, nodes).min())


def inverted_elements(mesh: TetMesh, nodes: FloatArray) -> int:
    """How many T10 elements of a mesh are flat or inside out at an integration point at `nodes` (N, 3)."""
    return int((_relative_jacobians(mesh, nodes) <= 0.0).any(axis=0).sum())


def _relative_jacobians(mesh: TetMesh, nodes: FloatArray) -> FloatArray:
    """The determinants (4, m)."""
    slopes = shape_slopes(GAUSS_POINTS, quadratic=True)  # (4 points, 10, 4)
    local = slopes[:, :, 1:] - slopes[:, :, :1]
    jacobians = np.einsum("pak,mai->pmik", local, nodes[mesh.tetrahedra])
    relative: FloatArray = np.linalg.det(jacobians) / (6.0 * mesh.corner_volumes_mm3)
    return relative


def tumour_motion(deformation: Deformation, tumour: Tumour) -> TumourMotion:
    """What the last stage did to a tumour."""
    carry = PointMap(deformation.mesh, deformation.displacement)
    surface = tumour.surface
    after = Tumour(tumour.name, type(surface)(carry.forward(surface.vertices), surface.triangles))
    moved = float(np.linalg.norm(after.centroid_mm - tumour.centroid_mm))
    return TumourMotion(moved, after.volume_mm3 / tumour.volume_mm3)


def height_over_board(points: FloatArray, board: Board) -> FloatArray:
    """Distance (n,) of points from a board, negative inside it, mm."""
    height: FloatArray = (points - board.point_mm) @ board.normal
    return height


def gap_to_lever(points: FloatArray, lever: Lever, angle_rad: float) -> FloatArray:
    """Distance (n,) of points (n, 3) from the rounded bar turned by an angle, negative inside, mm."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    arm = cos * lever.arm + sin * lever.up
    up = cos * lever.up - sin * lever.arm
    half = np.array([lever.length_mm, lever.thickness_mm, lever.width_mm]) / 2.0
    centre = lever.hinge_mm + half[0] * arm - half[1] * up
    offset = np.abs((points - centre) @ np.stack([arm, up, lever.axis]).T) - (half - lever.edge_radius_mm)
    outside = np.linalg.norm(np.maximum(offset, 0.0), axis=1)
    gap: FloatArray = outside + np.minimum(offset.max(axis=1), 0.0) - lever.edge_radius_mm
    return gap


def surface_nodes(mesh: TetMesh) -> IntArray:
    """Numbers of all nodes on the boundary, middle nodes among them."""
    triangles, _ = straight_boundary(mesh)
    nodes: IntArray = np.unique(triangles)
    return nodes
