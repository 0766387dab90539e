"""Where to touch next: the point of the surface that tells most of where a tumour is.

A touch measures one point of the surface along its normal. Of a normal distribution the covariance after such a
measurement is known before it is made, and does not depend on what it says (the rank-one update of Kalman 1960), so
points can be ranked by how much of the tumour's variance they take away (A-optimal design, Chaloner and Verdinelli
1995, Statistical Science 10:273).
"""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.observations import Observations
from glisson.core.registered import Registered
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.quadratic import straight_boundary

TOUCH_MM = 1.0
"""Standard deviation of a touch: a tracked tip's, and how far the surface is off beside what it is taken for."""

_FACING = 0.1
"""A point can be seen and reached where its normal is towards the viewer by a cosine of so much."""


@dataclass(frozen=True, eq=False)
class Touches:
    """Points (c, 3) of the surface as it is now, their outward normals (c, 3), areas (c,), and what a touch is worth.

    `drops_mm2` (c,) is how much a touch is expected to take from the trace of the tumour's covariance, which is
    `trace_mm2` before.
    """

    points_mm: FloatArray
    normals: FloatArray
    areas_mm2: FloatArray
    drops_mm2: FloatArray
    trace_mm2: float

    @property
    def best(self) -> int:
        """The number of the most telling one."""
        return int(np.argmax(self.drops_mm2))


def viewer(found: Registered, observations: Observations) -> FloatArray | None:
    """Unit vector (3,) towards whoever saw the surface: the mean of its normals where it was seen.

    None where nothing of the surface was seen.
    """
    seen = [item.points_mm for item in observations.items if item.kind in ("surface", "contact")]
    points = np.concatenate([np.zeros((0, 3)), *seen])
    if len(points) == 0:
        return None
    triangles, _ = straight_boundary(found.deformation.mesh)
    _, normals, _ = _faces(found.positions_mm, triangles)
    nearest = SurfaceTree(found.positions_mm, triangles).nearest(points)
    mean = normals[nearest.triangles].mean(axis=0)
    towards: FloatArray = mean / np.linalg.norm(mean)
    return towards


def touches(
    found: Registered, nodes: IntArray, weights: FloatArray, towards_viewer: FloatArray, sigma_mm: float = TOUCH_MM
) -> Touches:
    """All triangles of the surface that face the viewer, each touched in its middle.

    Args:
        found: the organ now.
        nodes: (a,) of which the tumour is a weighted mean.
        weights: (a,) of them.
        towards_viewer: unit vector (3,) in the frame of the observations.
        sigma_mm: standard deviation of a touch along the normal.
    """
    triangles, _ = straight_boundary(found.deformation.mesh)
    middles, normals, areas = _faces(found.positions_mm, triangles)
    facing = normals @ towards_viewer > _FACING
    triangles, normals = triangles[facing], normals[facing]
    tumour = np.einsum("a,aik->ik", weights, found.spread_mm[nodes])
    along = np.einsum("ci,cik->ck", normals, found.spread_mm[triangles].mean(axis=1))
    drops = ((along @ tumour.T) ** 2).sum(axis=1) / ((along**2).sum(axis=1) + sigma_mm**2)
    return Touches(middles[facing], normals, areas[facing], drops, float((tumour**2).sum()))


def _faces(positions: FloatArray, triangles: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Middles (f, 3), outward unit normals (f, 3) and areas (f,) of triangles."""
    corners = positions[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    return corners.mean(axis=1), normals / length[:, None], 0.5 * length
