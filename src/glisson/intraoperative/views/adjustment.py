"""Least squares over scope poses, what they have in common (hand–eye) and points: a bundle adjustment with priors.

Points are eliminated one by one (Schur's complement), so that its cost grows with their number only
(Triggs and others 1999, "Bundle adjustment: a modern synthesis").
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.intraoperative.views.residuals import Linearised, Problem, State, linearised

_STEPS = 200
_SMALL = 1e-3
"""A step of less than so many standard deviations is no step."""


@dataclass(frozen=True, eq=False)
class Solution:
    """The state of least cost; covariance of poses and hand–eye (d, d), of points (m, 3, 3), and across (d, m, 3)."""

    state: State
    at: Linearised
    of_poses: FloatArray
    of_points: FloatArray
    across: FloatArray


def solve(problem: Problem, state: State, least_gain: float = 1e-2) -> Solution:
    """The state of least cost by Levenberg's and Marquardt's method, damped as Nielsen (1999) does.

    Args:
        problem: what was measured.
        state: where to start.
        least_gain: it is at rest where χ² falls by less.

    Raises:
        StageFailed: it does not come to rest.
    """
    at, damping, growth = linearised(problem, state), 1e-4, 2.0
    for _ in range(_STEPS):
        normal = _Normal(problem, at)
        moved, size = normal.step(state, damping)
        tried = linearised(problem, moved)
        if tried.cost <= at.cost + 1e-9:
            gain = at.cost - tried.cost
            share = gain / max(size**2, 1e-12)
            state, at = moved, tried
            damping, growth = max(damping * max(1.0 / 3.0, 1.0 - (2.0 * share - 1.0) ** 3), 1e-9), 2.0
            if size < _SMALL or gain < least_gain:
                return _solution(problem, state, at)
        else:
            damping, growth = damping * growth, 2.0 * growth
    raise StageFailed("The views could not be brought together; check poses, tip and landmarks.", Status.STAGNATED)


def _solution(problem: Problem, state: State, at: Linearised) -> Solution:
    normal = _Normal(problem, at)
    of_poses = np.asarray(np.linalg.inv(normal.reduced()), dtype=np.float64)
    lever = normal.lever()
    across = -np.einsum("de,emk->dmk", of_poses, lever)
    of_points = normal.inverse - np.einsum("dmj,dmk->mjk", lever, across)
    return Solution(state, at, of_poses, of_points, across)


class _Normal:
    """The normal equations at a linearisation, whose points are eliminated."""

    def __init__(self, problem: Problem, at: Linearised) -> None:
        views, points = len(problem.poses), int(problem.point.max()) + 1
        self._size = 6 * views + 6 * (problem.hand_eye_covariance is not None)
        weighted = at.weights[:, None, None]
        by_pose, by_point = np.swapaxes(weighted * at.by_pose, 1, 2), np.swapaxes(weighted * at.by_point, 1, 2)
        self._poses, self._pose_side = _of_pose_priors(at, self._size)
        pose_blocks, pose_sides = by_pose @ at.by_pose, (by_pose @ at.seen[:, :, None])[:, :, 0]
        for number in range(views):
            rows, here = slice(6 * number, 6 * number + 6), problem.view == number
            self._poses[rows, rows] += pose_blocks[here].sum(axis=0)
            self._pose_side[rows] += pose_sides[here].sum(axis=0)
        order = np.argsort(problem.point, kind="stable")
        starts = np.searchsorted(problem.point[order], np.arange(points))
        self._points = np.add.reduceat((by_point @ at.by_point)[order], starts, axis=0)
        self._point_side = np.add.reduceat((by_point @ at.seen[:, :, None])[order, :, 0], starts, axis=0)
        known = np.swapaxes(at.by_known, 1, 2)
        self._points += known @ at.by_known
        self._point_side += (known @ at.known[:, :, None])[:, :, 0]
        mixed = np.zeros((views, 6, points, 3))  # a view sees a point once
        mixed[problem.view, :, problem.point] = by_pose @ at.by_point
        self._mixed = np.zeros((self._size, points, 3))
        self._mixed[: 6 * views] = mixed.reshape(6 * views, points, 3)
        self.inverse = np.linalg.inv(self._points)

    def lever(self) -> FloatArray:
        """W V⁻¹, (d, m, 3)."""
        arm: FloatArray = np.einsum("dmj,mjk->dmk", self._mixed, self.inverse)
        return arm

    def reduced(self) -> FloatArray:
        """U − W V⁻¹ Wᵀ, (d, d)."""
        flat = self._mixed.reshape(self._size, -1)
        result: FloatArray = self._poses - self.lever().reshape(self._size, -1) @ flat.T
        return result

    def step(self, state: State, damping: float) -> tuple[State, float]:
        """The state after a damped step, and the step's size in standard deviations."""
        diagonal = np.arange(3)
        damped = self._points.copy()
        damped[:, diagonal, diagonal] *= 1.0 + damping
        inverse = np.linalg.inv(damped)
        lever = np.einsum("dmj,mjk->dmk", self._mixed, inverse)
        flat = self._mixed.reshape(self._size, -1)
        reduced = self._poses + damping * np.diag(np.diag(self._poses)) - lever.reshape(self._size, -1) @ flat.T
        side = self._pose_side - np.einsum("dmk,mk->d", lever, self._point_side)
        poses = -np.linalg.solve(reduced, side)
        points = -np.einsum("mjk,mk->mj", inverse, self._point_side + np.einsum("dmk,d->mk", self._mixed, poses))
        gain = -(poses @ self._pose_side + (points * self._point_side).sum())
        return _moved(state, poses, points), float(np.sqrt(max(gain, 0.0)))


def _of_pose_priors(at: Linearised, size: int) -> tuple[FloatArray, FloatArray]:
    """What is known of poses and hand–eye beforehand, as normal equations (d, d) and (d,)."""
    views = len(at.prior)
    whole = np.zeros((6 * views + 6, 6 * views + 6))
    rest = np.concatenate([at.prior.reshape(-1), at.hand_eye])
    for number in range(views):
        rows = slice(6 * number, 6 * number + 6)
        whole[rows, rows], whole[rows, -6:] = at.prior_by_pose[number], at.prior_by_hand_eye[number]
    whole[-6:, -6:] = at.by_hand_eye
    derivative = whole[:, :size]
    return derivative.T @ derivative, derivative.T @ rest


def _moved(state: State, poses: FloatArray, points: FloatArray) -> State:
    """The state after a step; a point comes no nearer to a scope than half-way at once, so that none gets behind it."""
    nearest = np.linalg.norm(state.points_mm[:, None] - state.centres_mm, axis=2).min(axis=1)
    length = np.linalg.norm(points, axis=1)
    points = points * np.minimum(1.0, 0.5 * nearest / np.maximum(length, 1e-12))[:, None]
    views = len(state.centres_mm)
    steps = poses[: 6 * views].reshape(views, 6)
    turns = Rotation.from_rotvec(steps[:, :3]).as_matrix()
    hand_eye = state.hand_eye + poses[6 * views :] if len(poses) > 6 * views else state.hand_eye
    return replace(
        state,
        rotations=turns @ state.rotations,
        centres_mm=state.centres_mm + steps[:, 3:],
        hand_eye=hand_eye,
        points_mm=state.points_mm + points,
    )
