"""What is measured in laparoscope views, and how far a state of scopes and points is from it."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.camera import Camera
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import project_with_jacobian

_IDENTITY = RigidTransform("camera", "camera", np.eye(3), np.zeros(3))
_NEAREST_MM = 1.0


@dataclass(frozen=True, eq=False)
class Problem:
    """What was measured.

    Args:
        cameras: one for each view.
        poses: `room_from_camera` of each view as measured, with covariance.
        hand_eye_covariance: (6, 6) of what all poses have in common, or None.
        point, view: (n,) which point is seen in which view.
        pixels: (n, 2) where.
        sigma_px: (n,).
        cut: (n,) residuals beyond so many standard deviations count less (Huber 1964); infinite: never.
        known_mm: (m, 3) where the points are beforehand.
        known_covariance_mm2: (m, 3, 3) of it; large for points that are seen only.
    """

    cameras: tuple[Camera, ...]
    poses: tuple[RigidTransform, ...]
    hand_eye_covariance: FloatArray | None
    point: IntArray
    view: IntArray
    pixels: FloatArray
    sigma_px: FloatArray
    cut: FloatArray
    known_mm: FloatArray
    known_covariance_mm2: FloatArray

    @cached_property
    def white_poses(self) -> FloatArray:
        """Whitening (v, 6, 6) of the measured poses."""
        return np.array([_whitening(pose.covariance) for pose in self.poses if pose.covariance is not None])

    @cached_property
    def white_hand_eye(self) -> FloatArray:
        """Whitening (6, 6) of what the poses have in common; nought where that is not told apart."""
        return np.zeros((6, 6)) if self.hand_eye_covariance is None else _whitening(self.hand_eye_covariance)

    @cached_property
    def white_known(self) -> FloatArray:
        """Whitening (m, 3, 3) of the points."""
        return _whitening(self.known_covariance_mm2)


@dataclass(frozen=True, eq=False)
class State:
    """Where the scopes and the points are: rotations (v, 3, 3), centres (v, 3), hand–eye (6,), points (m, 3)."""

    rotations: FloatArray
    centres_mm: FloatArray
    hand_eye: FloatArray
    points_mm: FloatArray


@dataclass(frozen=True, eq=False)
class Linearised:
    """Whitened residuals about a state, and their derivatives.

    `seen` (n, 2) with `by_pose` (n, 2, 6) and `by_point` (n, 2, 3); `prior` (v, 6) of the poses with `prior_by_pose`
    (v, 6, 6) and `prior_by_hand_eye` (v, 6, 6); `hand_eye` (6,) and `known` (m, 3) of points with their whitenings.
    """

    seen: FloatArray
    by_pose: FloatArray
    by_point: FloatArray
    prior: FloatArray
    prior_by_pose: FloatArray
    prior_by_hand_eye: FloatArray
    hand_eye: FloatArray
    by_hand_eye: FloatArray
    known: FloatArray
    by_known: FloatArray
    weights: FloatArray
    cost: float


def linearised(problem: Problem, state: State) -> Linearised:
    """Residuals and derivatives at a state; the cost is infinite where a point is behind a scope."""
    seen, by_pose, by_point, behind = _sightings(problem, state)
    prior, prior_by_pose, prior_by_hand_eye = _pose_priors(problem, state)
    by_hand_eye = problem.white_hand_eye
    hand_eye = by_hand_eye @ state.hand_eye
    by_known = problem.white_known
    known = (by_known @ (state.points_mm - problem.known_mm)[:, :, None])[:, :, 0]
    length = np.linalg.norm(seen, axis=1)
    weights = np.minimum(1.0, problem.cut / np.maximum(length, 1e-12))
    held = np.minimum(length, problem.cut)
    robust = held * (2.0 * length - held)
    cost = float(robust.sum() + (prior**2).sum() + (hand_eye**2).sum() + (known**2).sum())
    return Linearised(
        seen, by_pose, by_point, prior, prior_by_pose, prior_by_hand_eye, hand_eye, by_hand_eye, known, by_known,
        weights, np.inf if behind else cost,
    )  # fmt: skip


def _sightings(problem: Problem, state: State) -> tuple[FloatArray, FloatArray, FloatArray, bool]:
    """Whitened residuals (n, 2) of pixels, by pose (n, 2, 6) and by point (n, 2, 3), and whether a point is behind."""
    count = len(problem.point)
    seen, by_pose, by_point = np.zeros((count, 2)), np.zeros((count, 2, 6)), np.zeros((count, 2, 3))
    behind = False
    for number, camera in enumerate(problem.cameras):
        here = problem.view == number
        turn = state.rotations[number]
        arms = state.points_mm[problem.point[here]] - state.centres_mm[number]
        in_camera = arms @ turn
        behind |= bool((in_camera[:, 2] <= _NEAREST_MM).any())
        pixels, jacobian = project_with_jacobian(camera, _IDENTITY, in_camera)
        by_place = jacobian[:, :, 3:6] @ turn.T
        seen[here], by_point[here] = pixels - problem.pixels[here], by_place
        by_pose[here, :, :3] = np.cross(by_place, arms[:, None, :])
        by_pose[here, :, 3:] = -by_place
    scale = problem.sigma_px[:, None]
    return seen / scale, by_pose / scale[:, :, None], by_point / scale[:, :, None], behind


def _pose_priors(problem: Problem, state: State) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Whitened differences (v, 6) from the measured poses, and their derivatives by pose and by hand–eye (v, 6, 6)."""
    views = len(problem.poses)
    rest, by_pose, by_hand_eye = np.zeros((views, 6)), np.zeros((views, 6, 6)), np.zeros((views, 6, 6))
    for number, pose in enumerate(problem.poses):
        turn, white = state.rotations[number], problem.white_poses[number]
        common = np.kron(np.eye(2), turn)
        apart = Rotation.from_matrix(turn @ pose.rotation.T).as_rotvec()
        off = np.concatenate([apart, state.centres_mm[number] - pose.translation_mm]) - common @ state.hand_eye
        rest[number], by_pose[number], by_hand_eye[number] = white @ off, white, -white @ common
    return rest, by_pose, by_hand_eye


def _whitening(covariance: FloatArray) -> FloatArray:
    """The matrices L⁻¹ (..., k, k) with L Lᵀ the covariances."""
    return np.linalg.inv(np.linalg.cholesky(covariance))
