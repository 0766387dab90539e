"""The surface of an implicit solid as triangles."""

import numpy as np
from skimage.measure import marching_cubes

from glisson.core.mesh import TriangleSurface
from glisson.phantom.implicit import Solid


def solid_surface(solid: Solid, step_mm: float) -> TriangleSurface:
    """The zero level of a solid by marching cubes on a grid of `step_mm`, closed and outward."""
    low, high = solid.bounds[0] - 3.0 * step_mm, solid.bounds[1] + 3.0 * step_mm
    count = np.ceil((high - low) / step_mm).astype(int) + 1
    axes = [low[a] + step_mm * np.arange(count[a]) for a in range(3)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    vertices, triangles, _, _ = marching_cubes(solid.distance(grid), 0.0, spacing=(step_mm,) * 3)
    surface = TriangleSurface(vertices + low, triangles)
    return surface if surface.volume_mm3 > 0.0 else TriangleSurface(surface.vertices, triangles[:, ::-1])
