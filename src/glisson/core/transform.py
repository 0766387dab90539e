"""Rigid transforms between named frames; a variable that holds one is named `target_from_source`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray, frozen_floats
from glisson.core.errors import BadInput

FRAMES = ("camera", "trocar", "room", "patient")
"""The frames an observation may be given in; "patient" is LPS mm."""


@dataclass(frozen=True, eq=False)
class RigidTransform:
    """x_target = rotation @ x_source + translation (mm).

    `covariance` is (6, 6) over a rotation vector in the target frame (rad) and the translation (mm).
    """

    target: str
    source: str
    rotation: FloatArray
    translation_mm: FloatArray
    covariance: FloatArray | None = None

    def __post_init__(self) -> None:
        rotation = frozen_floats(self.rotation, (3, 3), "rotation")
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6) or np.linalg.det(rotation) < 0.0:
            raise BadInput("A rotation must be orthonormal and right-handed.")
        object.__setattr__(self, "rotation", rotation)
        object.__setattr__(self, "translation_mm", frozen_floats(self.translation_mm, (3,), "translation"))
        if self.covariance is not None:
            object.__setattr__(self, "covariance", frozen_floats(self.covariance, (6, 6), "pose covariance"))

    def apply(self, points_mm: ArrayLike) -> FloatArray:
        """Points (n, 3) or (3,) of the source frame, in the target frame."""
        result: FloatArray = np.asarray(points_mm, dtype=np.float64) @ self.rotation.T + self.translation_mm
        return result
