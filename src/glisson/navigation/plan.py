"""What the surgeon planned: which tumour, and where to cut."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput
from glisson.core.structures import Plane


@dataclass(frozen=True, eq=False)
class Plan:
    """The target tumour's name (None: the largest) and how the resection plane is found.

    Without `plane_points_mm` the plane follows the rule of the dissertation's section 4.4, `distance_mm`
    from the tumour's surface along the wire. With three points (LPS mm, in A) it goes through them.

    Raises:
        BadInput: the points lie on one line, or the distance is not positive.
    """

    target: str | None = None
    plane_points_mm: FloatArray | None = None
    distance_mm: float = 5.0

    def __post_init__(self) -> None:
        if not 0.0 < self.distance_mm < 1000.0:
            raise BadInput(f"The plane's distance from the tumour must be positive, not {self.distance_mm} mm.")
        if self.plane_points_mm is None:
            return
        points = frozen_floats(self.plane_points_mm, (3, 3), "the three points of the resection plane")
        object.__setattr__(self, "plane_points_mm", points)
        u, v = points[1] - points[0], points[2] - points[0]
        if np.linalg.norm(np.cross(u, v)) <= 1e-3 * max(float(u @ u), float(v @ v), 1e-12):
            raise BadInput("The three points of the resection plane lie on one line; move one of them away.")

    @property
    def plane(self) -> Plane | None:
        """The plane through the three points, normal by the right-hand rule; None without points."""
        if self.plane_points_mm is None:
            return None
        a, b, c = self.plane_points_mm
        return Plane((a + b + c) / 3.0, np.cross(b - a, c - a))
