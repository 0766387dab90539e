"""Closed surfaces of masks whose volume is that of the mask.

Marching cubes (Lorensen and Cline 1987, in scikit-image's Lewiner variant) runs on the Gaussian-smoothed
mask. Smoothing shrinks a convex body when the level stays at one half, so the level is the one that
encloses as much as the mask's voxels; what decimation changes is put back along the normals.
"""

from dataclasses import dataclass
from typing import ClassVar

import fast_simplification
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.measure import marching_cubes

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import Grid, LabelMap
from glisson.core.mesh import TriangleSurface
from glisson.core.parameters import parameter
from glisson.core.status import Status
from glisson.geometry.normals import vertex_normals


@dataclass(frozen=True)
class MarchingCubesParameters:
    """How fine and how smooth the surface is."""

    edge_length_mm: float = parameter(4.0, "Mean edge of the surface's triangles in mm.", 0.2, 50.0)
    smoothing_voxels: float = parameter(
        0.7, "Standard deviation of the smoothing, in units of the largest voxel spacing.", 0.0, 3.0
    )


class MarchingCubes:
    """Smoothed marching cubes with the mask's volume, decimated to an edge length."""

    name: ClassVar[str] = "marching-cubes"
    summary: ClassVar[str] = "Marching cubes on the smoothed mask, keeping its volume."
    Parameters: ClassVar[type[MarchingCubesParameters]] = MarchingCubesParameters

    def __init__(self, parameters: MarchingCubesParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def extract(self, mask: NDArray[np.bool_], labels: LabelMap) -> TriangleSurface:
        """Closed outward surface (LPS mm) of a mask [i, j, k] on the grid of `labels`.

        A mask that touches the scan's border is closed there; see `borders.touched_borders`.

        Raises:
            BadInput: the mask is empty or on another grid.
            StageFailed: the surface could not be closed.
        """
        grid = labels.grid
        if mask.shape != grid.shape:
            raise BadInput(f"The mask has shape {mask.shape} but its grid {grid.shape}; resample it to the scan.")
        if not mask.any():
            raise BadInput("The mask is empty, so it has no surface; check the label's name or segment again.")
        vertices, triangles = self._isosurface(mask, grid)
        volume = float(mask.sum()) * grid.voxel_volume_mm3
        vertices, triangles = _decimated(vertices, triangles, self._parameters.edge_length_mm)
        surface = TriangleSurface(_with_volume(vertices, triangles, volume), triangles)
        if not surface.is_closed:
            raise StageFailed(
                "The mask's surface is not closed; smooth the mask or choose a finer edge.", Status.STAGNATED
            )
        return surface

    def _isosurface(self, mask: NDArray[np.bool_], grid: Grid) -> tuple[FloatArray, IntArray]:
        """Outward triangles in LPS mm at voxel resolution."""
        sigma = self._parameters.smoothing_voxels * float(grid.spacing_mm.max()) / grid.spacing_mm
        margin = np.ceil(3.0 * sigma).astype(int) + 2
        corner = [np.flatnonzero(mask.any(axis=tuple(a for a in range(3) if a != axis)))[[0, -1]] for axis in range(3)]
        box = tuple(slice(low, high + 1) for low, high in corner)
        padded = np.pad(mask[box].astype(np.float32), [(m, m) for m in margin])
        smooth = ndimage.gaussian_filter(padded, sigma, truncate=3.0) if sigma.any() else padded
        level = _level_enclosing(smooth, int(mask.sum()))
        indices, triangles, _, _ = marching_cubes(smooth, level, gradient_direction="descent")
        start = np.array([low for low, _ in corner]) - margin
        vertices = grid.points_from_indices(indices.astype(np.float64) + start)
        faces = triangles.astype(np.int64)
        if TriangleSurface(vertices, faces).volume_mm3 < 0.0:
            faces = faces[:, ::-1]
        return vertices, faces


def _level_enclosing(field: NDArray[np.float32], count: int) -> float:
    """Level above which `count` voxels of the field lie (the volume of a smooth field's superlevel set)."""
    ordered = np.partition(field.ravel(), field.size - count - np.array([1, 0]))
    below, above = (float(ordered[field.size - count - n]) for n in (1, 0))
    return 0.5 * (below + above)


def _decimated(vertices: FloatArray, triangles: IntArray, edge_length_mm: float) -> tuple[FloatArray, IntArray]:
    """Fewer triangles by quadric edge collapse (Garland and Heckbert 1997), about equilateral of that edge."""
    area = float(TriangleSurface(vertices, triangles).triangle_areas_mm2.sum())
    target = max(int(area / (np.sqrt(3.0) / 4.0 * edge_length_mm**2)), 100)
    if target >= len(triangles):
        return vertices, triangles
    points, faces = fast_simplification.simplify(
        vertices.astype(np.float32), triangles.astype(np.int32), target_count=target
    )
    return points.astype(np.float64), faces.astype(np.int64)


def _with_volume(vertices: FloatArray, triangles: IntArray, volume_mm3: float) -> FloatArray:
    """Vertices moved equally along their normals until the surface encloses the volume."""
    for _ in range(20):  # Newton's steps: three for an organ, more where the shift is not small to the body
        surface = TriangleSurface(vertices, triangles)
        missing = volume_mm3 - surface.volume_mm3
        if abs(missing) < 1e-9 * volume_mm3:
            break
        normals = vertex_normals(vertices, triangles)
        vertices = vertices + missing / float(surface.triangle_areas_mm2.sum()) * normals
    return vertices
