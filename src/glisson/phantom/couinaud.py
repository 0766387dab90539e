"""Couinaud's segments by construction: planes along the hepatic veins × planes along the portal branches.

The scheme is the radiological one (Couinaud 1957; Bismuth 1982): the right, middle and left scissurae
follow the three hepatic veins, the portal planes part the cranial (2, 8, 7) from the caudal (3, 5, 6)
segments, and the caudate lobe (1) lies between the vena cava and the portal bifurcation.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core.arrays import FloatArray
from glisson.core.structures import Plane
from glisson.phantom.implicit import Points, Solid

SEGMENT_NAMES = {number: f"segment {number}" for number in range(1, 9)}
"""Label numbers and names of the segments."""


@dataclass(frozen=True, eq=False)
class CouinaudPlanes:
    """The dividing planes. Positive sides: left of each scissura, cranial of each portal plane."""

    right_scissura: Plane
    middle_scissura: Plane
    left_scissura: Plane
    right_portal: Plane
    left_portal: Plane
    caudate: Solid

    def segments(self, points: Points) -> NDArray[np.uint8]:
        """Segment number 1 to 8 (...) of points (..., 3) inside the organ; every point has exactly one."""
        left = _positive(self.left_scissura, points)
        medial = _positive(self.middle_scissura, points)
        anterior = _positive(self.right_scissura, points)
        cranial = _positive(self.right_portal, points)
        right_lobe = np.where(anterior, np.where(cranial, 8, 5), np.where(cranial, 7, 6))
        left_lobe = np.where(left, np.where(_positive(self.left_portal, points), 2, 3), 4)
        segments = np.where(left | medial, left_lobe, right_lobe)
        # The left scissura is asked first, so a point beyond it is 2 or 3 even where the planes cross.
        segments = np.where(self.caudate.distance(points) < 0.0, 1, segments)
        return segments.astype(np.uint8)


def plane_along(start: ArrayLike, end: ArrayLike, towards: ArrayLike, tilt: float = 0.0) -> Plane:
    """The plane through a vessel from `start` to `end` that stands on the underside.

    It contains the vessel's direction and the anteroposterior axis, turned by `tilt` (rad) about the
    vessel; its normal points to the side of `towards` (3,).
    """
    a = np.asarray(start, dtype=np.float64)
    along = np.asarray(end, dtype=np.float64) - a
    along /= np.linalg.norm(along)
    upright = np.array([0.0, -1.0, 0.0])
    upright -= (upright @ along) * along
    upright /= np.linalg.norm(upright)
    normal = np.cross(along, np.cos(tilt) * upright + np.sin(tilt) * np.cross(along, upright))
    side: FloatArray = np.asarray(towards, dtype=np.float64) - a
    return Plane(a, normal if normal @ side > 0.0 else -normal)


def _positive(plane: Plane, points: Points) -> NDArray[np.bool_]:
    offset = float(plane.normal @ plane.point_mm)
    positive: NDArray[np.bool_] = points @ plane.normal.astype(points.dtype) > offset
    return positive
