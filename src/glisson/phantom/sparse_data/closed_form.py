"""Deformations in closed form that keep volume: pure bending and twisting, which no finite element made.

Both are exact finite deformations of an incompressible body (Rivlin 1949, Phil. Trans. R. Soc. A 242:173): det F = 1
everywhere, and the way back is in closed form, too.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray


class PointField(Protocol):
    """A map of space, points (n, 3) in mm to points (n, 3) in mm."""

    def forward(self, points: ArrayLike) -> FloatArray:
        """Where material points of the undeformed body go."""

    def back(self, points: ArrayLike) -> FloatArray:
        """Where points of the deformed body were."""

    def gradient(self, points: ArrayLike) -> FloatArray:
        """Deformation gradient F (n, 3, 3) at points (n, 3) of the undeformed body."""


@dataclass(frozen=True, eq=False)
class Frame:
    """An origin (3,) in mm and orthonormal axes, the columns of `axes` (3, 3): thickness, length, axis of bending."""

    origin_mm: FloatArray
    axes: FloatArray

    def local(self, points: ArrayLike) -> FloatArray:
        """Coordinates (n, 3) of points in this frame."""
        result: FloatArray = (np.asarray(points, dtype=np.float64).reshape(-1, 3) - self.origin_mm) @ self.axes
        return result

    def world(self, coordinates: FloatArray) -> FloatArray:
        """Points (n, 3) of coordinates in this frame."""
        result: FloatArray = coordinates @ self.axes.T + self.origin_mm
        return result

    def world_gradient(self, local: FloatArray) -> FloatArray:
        """A gradient (n, 3, 3) in this frame's coordinates as one in those of the world."""
        result: FloatArray = self.axes @ local @ self.axes.T
        return result


@dataclass(frozen=True, eq=False)
class Bend:
    """Pure bending of a block to a `radius_mm`, which the frame's middle plane takes without stretch.

    Thickness X and length Y become r = √(R² + 2 R X) and the angle Y / R about an axis at −R. Planes across the length
    stay planes. A body must end before X = −R / 2, where the radius vanishes.
    """

    frame: Frame
    radius_mm: float

    def forward(self, points: ArrayLike) -> FloatArray:
        """Where material points (n, 3) go."""
        x, y, z = self.frame.local(points).T
        radius, angle = self._radius(x), y / self.radius_mm
        return self.frame.world(np.stack([radius * np.cos(angle) - self.radius_mm, radius * np.sin(angle), z], axis=1))

    def back(self, points: ArrayLike) -> FloatArray:
        """Where points (n, 3) of the deformed body were."""
        x, y, z = self.frame.local(points).T
        radius, angle = np.hypot(x + self.radius_mm, y), np.arctan2(y, x + self.radius_mm)
        thickness = (radius**2 - self.radius_mm**2) / (2.0 * self.radius_mm)
        return self.frame.world(np.stack([thickness, angle * self.radius_mm, z], axis=1))

    def gradient(self, points: ArrayLike) -> FloatArray:
        """F (n, 3, 3)."""
        x, y, _ = self.frame.local(points).T
        radius, angle = self._radius(x), y / self.radius_mm
        along, around = self.radius_mm / radius, radius / self.radius_mm
        local = np.zeros((len(x), 3, 3))
        local[:, 0, 0], local[:, 0, 1] = along * np.cos(angle), -around * np.sin(angle)
        local[:, 1, 0], local[:, 1, 1] = along * np.sin(angle), around * np.cos(angle)
        local[:, 2, 2] = 1.0
        return self.frame.world_gradient(local)

    def _radius(self, thickness: FloatArray) -> FloatArray:
        radius: FloatArray = np.sqrt(self.radius_mm**2 + 2.0 * self.radius_mm * thickness)
        return radius


@dataclass(frozen=True, eq=False)
class Twist:
    """Planes across the frame's length turn about it, by `rate_per_mm` (rad/mm) from one to the next."""

    frame: Frame
    rate_per_mm: float

    def forward(self, points: ArrayLike) -> FloatArray:
        """Where material points (n, 3) go."""
        return self.frame.world(self._turned(self.frame.local(points), 1.0))

    def back(self, points: ArrayLike) -> FloatArray:
        """Where points (n, 3) of the deformed body were."""
        return self.frame.world(self._turned(self.frame.local(points), -1.0))

    def gradient(self, points: ArrayLike) -> FloatArray:
        """F (n, 3, 3)."""
        x, y, z = self.frame.local(points).T
        cos, sin = np.cos(self.rate_per_mm * y), np.sin(self.rate_per_mm * y)
        local = np.zeros((len(x), 3, 3))
        local[:, 0, 0], local[:, 0, 2] = cos, sin
        local[:, 2, 0], local[:, 2, 2] = -sin, cos
        local[:, 0, 1] = self.rate_per_mm * (-sin * x + cos * z)
        local[:, 2, 1] = self.rate_per_mm * (-cos * x - sin * z)
        local[:, 1, 1] = 1.0
        return self.frame.world_gradient(local)

    def _turned(self, places: FloatArray, sign: float) -> FloatArray:
        x, y, z = places.T
        angle = sign * self.rate_per_mm * y
        return np.stack([np.cos(angle) * x + np.sin(angle) * z, y, np.cos(angle) * z - np.sin(angle) * x], axis=1)


@dataclass(frozen=True, eq=False)
class InTurn:
    """The first map, then the second."""

    first: PointField
    second: PointField

    def forward(self, points: ArrayLike) -> FloatArray:
        """Where material points (n, 3) go."""
        return self.second.forward(self.first.forward(points))

    def back(self, points: ArrayLike) -> FloatArray:
        """Where points (n, 3) of the deformed body were."""
        return self.first.back(self.second.back(points))

    def gradient(self, points: ArrayLike) -> FloatArray:
        """F (n, 3, 3), by the chain rule."""
        result: FloatArray = self.second.gradient(self.first.forward(points)) @ self.first.gradient(points)
        return result
