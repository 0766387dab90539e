"""The pose of a wheel from its rims, and what the trocar's pivot says to it."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.core.trocar import Trocar
from glisson.intraoperative.cameras.projection import project_with_jacobian
from glisson.intraoperative.instruments.rim_edges import ANGLES, RimEdges

ROLL_RAD = 0.02
"""Standard deviation of the turn about the axis, which the rims do not tell."""

LEAST_SHARE = 0.25
"""A pose needs edges at so many of the points of the circles."""

_STEPS = 12
_WINDOWS = (0.12, 0.07, 0.05, 0.035)
"""How far edges are looked for after each step, in wheel radii."""
_LEAST_NOISE_PX = 0.03
_INDEPENDENT = 0.2
"""Of neighbouring edges this share tells something new: blur and the pixel grid shift them together."""
_TUKEY = 4.0
_GROWTH_PX = 0.3
"""Standard deviation of how far white has grown over its edges, by the camera's gamma, glow or spread ink."""

EdgeFinder = Callable[[RigidTransform, float], RimEdges]
"""Edges near a pose within a window."""


@dataclass(frozen=True, eq=False)
class WheelPose:
    """A pose `trocar_from_instrument` with covariance, and the edges on which it rests."""

    pose: RigidTransform
    edges: RimEdges
    noise_px: float

    def misfit(self, noise_px: float, trocar: Trocar) -> float:
        """Squared residuals of all edges, at this noise, and of the pivot."""
        off, _ = past_pivot(self.pose, trocar)
        count = _INDEPENDENT * len(self.edges.off_px)
        return count * (self.noise_px / noise_px) ** 2 + float(off @ off) / trocar.play_mm**2

    def point(self, point_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """A point (3,) of the instrument in the frame "trocar", and its covariance (3, 3)."""
        return self.pose.apply(point_mm), self.pose.point_covariance(point_mm)


def fitted_pose(
    camera: Camera, start: RigidTransform, radius_mm: float, find: EdgeFinder, trocar: Trocar | None = None
) -> WheelPose:
    """The pose that brings the circles of a wheel onto the edges; with a trocar its axis passes the pivot, too.

    How far white has grown is estimated, too: it widens a white ring to both sides, so that it is no change of size.
    The covariance has the noise of the edges, the pivot's play and, where it is known, the camera's covariance.

    Args:
        camera: the trocar's.
        start: a pose near it, `trocar_from_instrument`.
        radius_mm: the wheel's radius.
        find: gives the edges near a pose.
        trocar: whose pivot and play are observations like any other; None: edges alone.

    Raises:
        StageFailed: too few edges, as where most of the wheel is hidden.
    """
    pose, growth = start, 0.0
    for step in range(_STEPS):
        edges = find(pose, _WINDOWS[min(step, len(_WINDOWS) - 1)])
        if edges.share < LEAST_SHARE:
            raise StageFailed("Too little of the wheel's rims can be seen.", Status.UNOBSERVABLE)
        system = _System.of(camera, pose, growth, radius_mm, edges, trocar)
        change = np.asarray(np.linalg.solve(system.information, system.pull), dtype=np.float64)
        pose, growth = pose.moved(change[:6]), growth + float(change[6])
        if step >= len(_WINDOWS) and np.abs(change).max() < 1e-5:
            break
    inverse = np.asarray(np.linalg.inv(system.information), dtype=np.float64)
    covariance = inverse[:6, :6]
    if camera.covariance is not None:
        by_camera = (inverse @ system.by_camera)[:6]
        covariance = covariance + by_camera @ camera.covariance @ by_camera.T
    return WheelPose(replace(pose, covariance=covariance), edges, system.noise_px)


def past_pivot(pose: RigidTransform, trocar: Trocar) -> tuple[FloatArray, FloatArray]:
    """How far (2,) an axis passes the pivot by, along its x and y, and the derivative (2, 6) by d and e."""
    x, y = pose.rotation[:, 0], pose.rotation[:, 1]
    away = trocar.pivot_mm - pose.translation_mm
    off = np.array([x @ away, y @ away])
    return off, np.stack([np.concatenate([np.cross(one, away), -one]) for one in (x, y)])


def disagreement(found: WheelPose, trocar: Trocar) -> float:
    """Squared Mahalanobis distance (2 degrees of freedom) of the axis, as the rims have it, from the pivot."""
    off, jacobian = past_pivot(found.pose, trocar)
    assert found.pose.covariance is not None
    spread = jacobian @ found.pose.covariance @ jacobian.T + trocar.play_mm**2 * np.eye(2)
    return float(off @ np.linalg.solve(spread, off))


@dataclass(frozen=True, eq=False)
class _System:
    """Normal equations of one step: information (7, 7), pull (7,), and by how the camera errs (7, 9).

    The unknowns are those of the pose and how far white has grown.
    """

    information: FloatArray
    pull: FloatArray
    by_camera: FloatArray
    noise_px: float

    @classmethod
    def of(
        cls,
        camera: Camera,
        pose: RigidTransform,
        growth_px: float,
        radius_mm: float,
        edges: RimEdges,
        trocar: Trocar | None,
    ) -> "_System":
        _, jacobian = project_with_jacobian(camera, pose, edges.points * radius_mm)
        by_all = np.einsum("ni,nij->nj", edges.normals, jacobian)
        rows = np.column_stack([by_all[:, :6], edges.growing])
        off = edges.off_px - growth_px * edges.growing
        noise = max(1.4826 * float(np.median(np.abs(off))), _LEAST_NOISE_PX)
        weights = (1.0 - np.minimum(np.abs(off) / (_TUKEY * noise), 1.0) ** 2) ** 2
        kept = weights > 0.0
        noise = max(float(np.sqrt(np.average(off[kept] ** 2, weights=weights[kept]))), _LEAST_NOISE_PX)
        # Wheels that are small in the image have fewer pixels on a circle than there are edges asked for.
        around = np.linalg.norm(np.ptp(edges.predicted_px, axis=0)) * np.pi / np.sqrt(2.0)
        shared = _INDEPENDENT * min(1.0, around / ANGLES) / noise**2
        weighted = rows * (weights * shared)[:, None]
        axis = np.concatenate([pose.rotation[:, 2], np.zeros(4)])
        information = weighted.T @ rows + np.outer(axis, axis) / ROLL_RAD**2
        information[6, 6] += 1.0 / _GROWTH_PX**2
        pull = weighted.T @ off
        pull[6] -= growth_px / _GROWTH_PX**2
        if trocar is not None:
            past, by_pose = past_pivot(pose, trocar)
            information[:6, :6] += by_pose.T @ by_pose / trocar.play_mm**2
            pull[:6] -= by_pose.T @ past / trocar.play_mm**2
        return cls(information, pull, weighted.T @ by_all[:, 6:15], noise)
