"""How much of the liver a plane removes, by exact cutting, and the same as voxel labels."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.image import LabelMap
from glisson.core.mesh import TetMesh, signed_volumes
from glisson.core.structures import Plane
from glisson.geometry.cutting import volume_beyond
from glisson.geometry.quadratic import straight_tetrahedra

REMAINING, REMOVED = 1, 2


def organ_volume_mm3(mesh: TetMesh, nodes: FloatArray) -> float:
    """Volume in mm³ of the mesh at `nodes` (n, 3); each T10 element as eight straight tetrahedra."""
    return float(signed_volumes(nodes, straight_tetrahedra(mesh)).sum())


def removed_volume_mm3(mesh: TetMesh, nodes: FloatArray, plane: Plane) -> float:
    """Volume in mm³ on the removed side of a plane, of the same straight tetrahedra."""
    return float(volume_beyond(nodes, straight_tetrahedra(mesh), plane).sum())


def removed_fraction(mesh: TetMesh, nodes: FloatArray, plane: Plane) -> float:
    """Removed part of the organ's volume at `nodes`, 0 to 1."""
    return removed_volume_mm3(mesh, nodes, plane) / organ_volume_mm3(mesh, nodes)


def label_parts(organ: LabelMap, plane: Plane | None) -> LabelMap:
    """Both parts of the organ in A as voxels on the scan's grid: "remaining" (1) and "removed" (2).

    A voxel belongs to the side that its centre lies on; without a plane all of it remains.
    """
    voxels = np.where(organ.voxels != 0, REMAINING, 0).astype(np.uint8)
    if plane is not None:
        inside = np.argwhere(voxels)
        removed = inside[plane.distance_mm(organ.grid.points_from_indices(inside)) > 0.0]
        voxels[tuple(removed.T)] = REMOVED
    return LabelMap(voxels, organ.grid, {REMAINING: "remaining", REMOVED: "removed"})
