"""Which measurements the others contradict: the tip in a view, a scope's pose, a landmark.

Each group of residuals is held against its own covariance after the adjustment (Baarda 1968's data snooping), which to
first order is how much the least cost falls when the group is left out.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from glisson.core.arrays import FloatArray, IntArray
from glisson.intraoperative.views.adjustment import Solution
from glisson.intraoperative.views.residuals import Problem

_FALSE_ALARMS = 1e-3
"""So many adjustments of good measurements are flagged."""

_LEAST = 1e-4
"""A direction in which the others tell so small a part of a measurement tells nothing of its being right."""


def contradictions(problem: Problem, solution: Solution, views: Sequence[str], names: Sequence[str]) -> tuple[str, ...]:
    """A sentence for each measurement that does not fit, the worst first.

    Args:
        problem: point 0 is the touched one, the next ones are the landmarks.
        solution: of it.
        views: names of the views.
        names: of the landmarks.
    """
    found: list[tuple[float, str]] = []
    tests = 2 * len(views) + len(names)
    for number, view in enumerate(views):
        rows = np.flatnonzero((problem.point == 0) & (problem.view == number)).astype(np.int64)
        off = float(np.linalg.norm(solution.at.seen[rows[0]]) * problem.sigma_px[rows[0]])
        sentence = (
            f"The tool's tip in {view} lies {off:.1f} px from where all else puts it; it moved between the views."
        )
        found.append((_chance(*_sighting_residuals(problem, solution, rows)), sentence))
        sentence = f"The pose of {view} does not fit what is seen; the laparoscope's tracking or hand–eye is off."
        found.append((_chance(*_pose_residuals(solution, number)), sentence))
    for number, name in enumerate(names):
        rows = np.flatnonzero(problem.point == 1 + number).astype(np.int64)
        sentence = f"The landmark {name!r} is not the same point in all views, or it moved between them."
        found.append((_chance(*_sighting_residuals(problem, solution, rows)), sentence))
    return tuple(sentence for chance, sentence in sorted(found) if chance < _FALSE_ALARMS / tests)


def _sighting_residuals(problem: Problem, solution: Solution, rows: IntArray) -> tuple[FloatArray, FloatArray]:
    """Residuals (r,) of sightings of one point, and their covariance (r, r)."""
    point, size = int(problem.point[rows[0]]), len(solution.of_poses)
    by_poses = np.zeros((2 * len(rows), size))
    for row, index in enumerate(rows):
        first = 6 * int(problem.view[index])
        by_poses[2 * row : 2 * row + 2, first : first + 6] = solution.at.by_pose[index]
    by_point = solution.at.by_point[rows].reshape(-1, 3)
    mixed = by_poses @ solution.across[:, point] @ by_point.T
    fitted = by_poses @ solution.of_poses @ by_poses.T + mixed + mixed.T
    fitted += by_point @ solution.of_points[point] @ by_point.T
    return solution.at.seen[rows].reshape(-1), np.eye(len(fitted)) - fitted


def _pose_residuals(solution: Solution, number: int) -> tuple[FloatArray, FloatArray]:
    by_poses = np.zeros((6, len(solution.of_poses)))
    by_poses[:, 6 * number : 6 * number + 6] = solution.at.prior_by_pose[number]
    if len(solution.of_poses) > 6 * len(solution.at.prior):
        by_poses[:, -6:] = solution.at.prior_by_hand_eye[number]
    return solution.at.prior[number], np.eye(6) - by_poses @ solution.of_poses @ by_poses.T


def _chance(residuals: FloatArray, covariance: FloatArray) -> float:
    """How likely good measurements have residuals as large."""
    spread, axes = np.linalg.eigh(covariance)
    told = spread > _LEAST
    if not told.any():
        return 1.0
    return float(chi2.sf(((axes.T @ residuals)[told] ** 2 / spread[told]).sum(), int(told.sum())))
