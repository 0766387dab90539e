"""A calibrated camera: a pinhole with Brown's distortion, as OpenCV has it."""

from dataclasses import dataclass, field

import numpy as np

from glisson.core.arrays import FloatArray, frozen_covariance, frozen_floats
from glisson.core.errors import BadInput


@dataclass(frozen=True, eq=False)
class Camera:
    """Maps points of the frame "camera" (x right, y down, z forward, mm) to pixels (u right, v down).

    The middle of the first pixel is (0, 0).

    Args:
        width: of its images, px.
        height: of its images, px.
        focal_px: focal lengths (2,) along u and v.
        centre_px: the principal point (2,).
        distortion: k1, k2, p1, p2, k3 (Brown 1966), applied to x / z and y / z.
        covariance: (9, 9) of focal lengths, principal point and distortion in this order, if known.
    """

    width: int
    height: int
    focal_px: FloatArray
    centre_px: FloatArray
    distortion: FloatArray = field(default_factory=lambda: np.zeros(5))
    covariance: FloatArray | None = None

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise BadInput(f"A camera's image of {self.width} × {self.height} px is no image.")
        object.__setattr__(self, "focal_px", frozen_floats(self.focal_px, (2,), "focal length"))
        object.__setattr__(self, "centre_px", frozen_floats(self.centre_px, (2,), "principal point"))
        object.__setattr__(self, "distortion", frozen_floats(self.distortion, (5,), "distortion"))
        if (self.focal_px <= 0.0).any():
            raise BadInput("A camera's focal lengths must be positive.")
        if self.covariance is not None:
            covariance = frozen_covariance(self.covariance, (9, 9), "the camera's covariance", singular=True)
            object.__setattr__(self, "covariance", covariance)

    @property
    def matrix(self) -> FloatArray:
        """The matrix K (3, 3) of focal lengths and principal point."""
        (fu, fv), (u, v) = self.focal_px, self.centre_px
        return np.array([[fu, 0.0, u], [0.0, fv, v], [0.0, 0.0, 1.0]])
