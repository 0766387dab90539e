"""Rigid transforms between named frames; a variable that holds one is named `target_from_source`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray, frozen_covariance, frozen_floats
from glisson.core.errors import BadInput

FRAMES = ("camera", "trocar", "room", "patient")
"""The frames an observation may be given in; "patient" is LPS mm."""


@dataclass(frozen=True, eq=False)
class RigidTransform:
    """x_target = rotation @ x_source + translation (mm).

    `covariance` is (6, 6) over d (a rotation vector in the target frame, rad) and e (mm) in
    exp([d]×) rotation and translation + e.
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
            covariance = frozen_covariance(self.covariance, (6, 6), "the pose's covariance", singular=True)
            object.__setattr__(self, "covariance", covariance)

    def apply(self, points_mm: ArrayLike) -> FloatArray:
        """Points (n, 3) or (3,) of the source frame, in the target frame."""
        result: FloatArray = np.asarray(points_mm, dtype=np.float64) @ self.rotation.T + self.translation_mm
        return result

    def moved(self, step: FloatArray) -> "RigidTransform":
        """The transform after a step (6,) of d and e; without covariance."""
        from scipy.spatial.transform import Rotation  # slow to load, and `--help` needs this module

        turn = Rotation.from_rotvec(step[:3]).as_matrix()
        return RigidTransform(self.target, self.source, turn @ self.rotation, self.translation_mm + step[3:])

    def inverse(self) -> "RigidTransform":
        """`source_from_target`, with its covariance to first order."""
        back = self.rotation.T
        covariance = None
        if self.covariance is not None:
            jacobian = np.block([[-back, np.zeros((3, 3))], [-back @ cross_matrix(self.translation_mm), -back]])
            covariance = jacobian @ self.covariance @ jacobian.T
        return RigidTransform(self.source, self.target, back, -back @ self.translation_mm, covariance)

    def after(self, first: "RigidTransform") -> "RigidTransform":
        """`first`, then this: `a_from_b.after(b_from_c)` is a_from_c, the errors of both taken as independent.

        A transform without covariance is taken as exact, unless neither has one.

        Raises:
            BadInput: `first` does not end in the frame in which this begins.
        """
        if first.target != self.source:
            raise BadInput(f"A transform from {self.source!r} cannot follow one to {first.target!r}.")
        rotation = self.rotation @ first.rotation
        turned = self.rotation @ first.translation_mm
        covariance = None
        if self.covariance is not None or first.covariance is not None:
            covariance = np.zeros((6, 6))
            if self.covariance is not None:
                own = np.block([[np.eye(3), np.zeros((3, 3))], [-cross_matrix(turned), np.eye(3)]])
                covariance += own @ self.covariance @ own.T
            if first.covariance is not None:
                both = np.kron(np.eye(2), self.rotation)
                covariance += both @ first.covariance @ both.T
        return RigidTransform(self.target, first.source, rotation, turned + self.translation_mm, covariance)

    def point_covariance(self, point_mm: ArrayLike, covariance_mm2: ArrayLike | None = None) -> FloatArray:
        """Covariance (3, 3) in mm² of a point (3,) of the source frame in the target frame.

        Args:
            point_mm: the point.
            covariance_mm2: its own (3, 3) in the source frame; None: it is exact.
        """
        total = np.zeros((3, 3))
        if covariance_mm2 is not None:
            total += self.rotation @ np.asarray(covariance_mm2, dtype=np.float64) @ self.rotation.T
        if self.covariance is not None:
            turned = self.rotation @ np.asarray(point_mm, dtype=np.float64)
            jacobian = np.hstack([-cross_matrix(turned), np.eye(3)])
            total += jacobian @ self.covariance @ jacobian.T
        return total


def cross_matrix(vector: ArrayLike) -> FloatArray:
    """The matrix (3, 3) whose product with w is the cross product of a vector (3,) with w."""
    x, y, z = np.asarray(vector, dtype=np.float64)
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
