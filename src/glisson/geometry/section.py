"""Where a plane cuts a triangle surface."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TriangleSurface
from glisson.core.structures import Plane


def section(surface: TriangleSurface, plane: Plane) -> FloatArray:
    """Line segments (k, 2, 3) in mm along which a plane cuts a surface, in no order.

    A vertex exactly on the plane counts as lying on its removed side, so that a closed surface gives
    closed outlines.
    """
    heights = plane.distance_mm(surface.vertices)
    above = heights >= 0.0
    triangles = surface.triangles
    count = above[triangles].sum(axis=1)
    cut = triangles[(count == 1) | (count == 2)]
    lonely = above[cut].sum(axis=1) == 1
    # Turn each triangle so that its first corner is the one alone on its side.
    alone = np.argmax(above[cut] == lonely[:, None], axis=1)
    apex, left, right = (np.take_along_axis(cut, ((alone + k) % 3)[:, None], axis=1)[:, 0] for k in range(3))
    ends = []
    for other in (left, right):
        share = (heights[apex] / (heights[apex] - heights[other]))[:, None]
        ends.append((1.0 - share) * surface.vertices[apex] + share * surface.vertices[other])
    return np.stack(ends, axis=1)
