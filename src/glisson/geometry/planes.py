"""Planes through points: by three of them, or by least squares through many."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.structures import Plane


@dataclass(frozen=True, eq=False)
class PlaneFit:
    """A fitted plane and the RMS distance of the points from it, mm."""

    plane: Plane
    rms_mm: float


def fit_plane(points_mm: ArrayLike, towards: FloatArray) -> PlaneFit:
    """Plane with the least sum of squared distances to points (n, 3); its normal agrees with `towards` (3,).

    Raises:
        BadInput: fewer than three points, or all on one line.
    """
    points = np.asarray(points_mm, dtype=np.float64).reshape(-1, 3)
    if len(points) < 3:
        raise BadInput(f"A plane needs three points at least, not {len(points)}.")
    centre = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - centre, full_matrices=False)
    if spread[1] <= 1e-9 * max(spread[0], 1e-300):
        raise BadInput("The points of the plane lie on one line; give points that span a plane.")
    normal = axes[2] if axes[2] @ towards >= 0.0 else -axes[2]
    return PlaneFit(Plane(centre, normal), float(spread[2] / np.sqrt(len(points))))


def angle_between_deg(first: Plane, second: Plane) -> float:
    """Angle between two planes' normals, degrees in [0, 180]; exact for small angles too."""
    sine = np.linalg.norm(np.cross(first.normal, second.normal))
    return float(np.degrees(np.arctan2(sine, first.normal @ second.normal)))


def plane_basis(plane: Plane) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors (3,), (3,) in the plane, right-handed with its normal."""
    axis = np.zeros(3)
    axis[np.argmin(np.abs(plane.normal))] = 1.0
    u = np.cross(axis, plane.normal)
    u /= np.linalg.norm(u)
    return u, np.cross(plane.normal, u)
