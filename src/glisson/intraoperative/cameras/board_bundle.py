"""The bundle adjustment behind a calibration: one camera, and one pose for each view of the board."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import BadInput
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.adjustment import Minimum, NormalEquations, minimum
from glisson.intraoperative.cameras.projection import project, project_with_jacobian

INTRINSIC = 4
"""Focal lengths and principal point come before the distortion."""


@dataclass(frozen=True, eq=False)
class Seen:
    """Points (n, 3) of the board in mm, the pixels (n, 2) at which they were found, and how much each counts (n,)."""

    points_mm: FloatArray
    pixels: FloatArray
    weights: FloatArray


@dataclass(frozen=True, eq=False)
class Bundle:
    """A camera, `camera_from_board` of each view, and which distortion terms are estimated."""

    camera: Camera
    poses: tuple[RigidTransform, ...]
    terms: tuple[int, ...]

    @property
    def free(self) -> list[int]:
        """Indices, in the order of a camera's covariance, of what is estimated."""
        return [0, 1, 2, 3, *(INTRINSIC + term for term in self.terms)]

    def residuals(self, seen: Iterable[Seen]) -> list[FloatArray]:
        """Found minus computed pixels (n, 2) of each view."""
        return [
            one.pixels - project(self.camera, pose, one.points_mm) for one, pose in zip(seen, self.poses, strict=True)
        ]

    def moved(self, step: FloatArray) -> "Bundle":
        """Moved by steps of the free intrinsics, then 6 of each pose; itself where that is no camera."""
        free = self.free
        values = np.concatenate([self.camera.focal_px, self.camera.centre_px, self.camera.distortion])
        values[free] += step[: len(free)]
        try:
            camera = Camera(self.camera.width, self.camera.height, values[:2], values[2:4], values[4:])
        except BadInput:
            return self
        steps = step[len(free) :].reshape(-1, 6)
        poses = tuple(pose.moved(one) for pose, one in zip(self.poses, steps, strict=True))
        return Bundle(camera, poses, self.terms)


def adjusted_bundle(start: Bundle, seen: Sequence[Seen]) -> Minimum[Bundle]:
    """The bundle that explains what was seen with the least squares of pixels."""
    return minimum(start, lambda bundle: _equations(bundle, seen), Bundle.moved)


def _equations(bundle: Bundle, seen: Sequence[Seen]) -> NormalEquations:
    free = np.array(bundle.free)
    size = len(free) + 6 * len(seen)
    matrix, gradient, cost = np.zeros((size, size)), np.zeros(size), 0.0
    for number, (one, pose) in enumerate(zip(seen, bundle.poses, strict=True)):
        pixels, jacobian = project_with_jacobian(bundle.camera, pose, one.points_mm)
        root = np.sqrt(one.weights)[:, None]
        off = (root * (pixels - one.pixels)).ravel()
        own = len(free) + 6 * number + np.arange(6)
        columns = np.concatenate([np.arange(len(free)), own])
        rows = np.concatenate([jacobian[:, :, 6 + free], jacobian[:, :, :6]], axis=2) * root[:, :, None]
        rows = rows.reshape(len(off), -1)
        matrix[np.ix_(columns, columns)] += rows.T @ rows
        gradient[columns] += rows.T @ off
        cost += 0.5 * float(off @ off)
    return NormalEquations(cost, gradient, matrix)
