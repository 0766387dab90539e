"""Joint adjustment of scope poses, touched point, roll and hand–eye, over two or more views."""

from dataclasses import replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import StageFailed
from glisson.core.observations import Observation, Observations
from glisson.core.protocols import Progress, Reconstruction, silent
from glisson.core.status import Status
from glisson.core.transform import RigidTransform
from glisson.core.views import Sightings, ViewSet
from glisson.intraoperative.cameras.projection import directions
from glisson.intraoperative.views.adjustment import Solution, solve
from glisson.intraoperative.views.contradictions import contradictions
from glisson.intraoperative.views.epipolar import epipolar_statistics
from glisson.intraoperative.views.outcome import landmark_observations, observation
from glisson.intraoperative.views.parallax import judged, parallax_rad, require_parallax
from glisson.intraoperative.views.parameters import ReconstructionParameters
from glisson.intraoperative.views.residuals import Problem, State

_GATE = float(chi2.isf(1e-4, 1))
_MOST_REFUSED = 0.5
"""Where the poses refuse more of the features, either is wrong, and no feature can be relied on."""

_CUT, _FAR = 3.0, 5.0
"""Features count less beyond the first, and not at all beyond the second, in standard deviations."""

_ROUGH = 1.0
"""The first adjustment need not be better than so much of χ²: with wrong features in it, it creeps."""

_LOOSE = 3.0
"""The surface is as far as the touched point, give or take so many times that; it keeps what is wrong in reach."""

_UNKNOWN_ROLL_RAD = 0.2
"""A roll that is known no better is first taken from the touched point."""


class Bundle:
    """Least squares of what was measured, weighted by its covariance; features over the whole image tie the views."""

    name: ClassVar[str] = "bundle"
    summary: ClassVar[str] = "Joint adjustment of poses, touched point, roll and hand-eye over two or more views."
    Parameters: ClassVar[type[ReconstructionParameters]] = ReconstructionParameters

    def __init__(self, parameters: ReconstructionParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies."""
        return ()

    def reconstruct(self, views: ViewSet, progress: Progress = silent) -> Reconstruction:
        """Reconstruct landmarks and features; see `glisson.core.protocols.SurfaceReconstructor`."""
        sigma = views.landmarks.sigma_px if views.names else views.features.sigma_px
        require_parallax(views.views, views.touched_mm, sigma, self._parameters.worst_mm)
        features, refused = _credible(views)
        try:
            problem, solution = _solved(views, features)
        except np.linalg.LinAlgError as error:
            raise StageFailed("The views leave a point's place open; move farther.", Status.UNOBSERVABLE) from error
        centres, points = solution.state.centres_mm, solution.state.points_mm
        angle = float(np.median(parallax_rad(centres, points[1:] if len(points) > 1 else points)))
        notes = judged(solution.of_points, angle, self._parameters.worst_mm, self._parameters.doubtful_mm)
        wrong = contradictions(problem, solution, [view.name for view in views.views], views.names)
        if refused > _MOST_REFUSED * views.features.count:
            wrong += (
                f"{refused} of {views.features.count} features contradict the measured poses; the tissue moved between "
                "the views, or the poses are wrong. No feature was used.",
            )
        status = Status.AMBIGUOUS if wrong else Status.CONVERGED
        observed = _observed(views, solution, self._parameters.worst_mm)
        return Reconstruction(Observations(observed), status, wrong + notes, angle)


def _solved(views: ViewSet, features: Sightings) -> tuple[Problem, Solution]:
    """The adjustment: roughly first, then without the features that this leaves far from where they are seen."""
    problem, start = _problem(views, features)
    rough = solve(problem, start, _ROUGH)
    far = (np.linalg.norm(rough.at.seen, axis=1) > _FAR)[len(problem.point) - len(features.point) :]
    bad = np.zeros(features.count, dtype=bool)
    bad[features.point[far]] = True
    problem, _ = _problem(views, _without(features, bad))
    kept = np.concatenate([np.ones(1 + len(views.names), dtype=bool), ~bad])
    return problem, solve(problem, replace(rough.state, points_mm=rough.state.points_mm[kept]))


def _credible(views: ViewSet) -> tuple[Sightings, int]:
    """Features that all pairs of their views allow, numbered anew, and how many were refused."""
    seen, bad = views.features, np.zeros(views.features.count, dtype=bool)
    for first in range(len(views.views)):
        for second in range(first + 1, len(views.views)):
            one, two = (np.flatnonzero(seen.view == number) for number in (first, second))
            _, left, right = np.intersect1d(seen.point[one], seen.point[two], return_indices=True)
            pixels = (seen.pixels[one[left]], seen.pixels[two[right]])
            pair = views.views[first], views.views[second]
            missed = epipolar_statistics(*pair, pixels, seen.sigma_px, views.hand_eye_covariance) > _GATE
            bad[seen.point[one[left]][missed]] = True
    refused = int(bad.sum())
    if refused > _MOST_REFUSED * len(bad):
        bad[:] = True
    return _without(seen, bad), refused


def _without(seen: Sightings, bad: NDArray[np.bool_]) -> Sightings:
    """The sightings of points that are not bad (m,), numbered anew."""
    keep = ~bad[seen.point]
    numbers = np.unique(seen.point[keep], return_inverse=True)[1]
    return Sightings(numbers.astype(np.int64), seen.view[keep], seen.pixels[keep], seen.sigma_px)


def _problem(views: ViewSet, features: Sightings) -> tuple[Problem, State]:
    """The measurements and where to start; point 0 is the touched one, then come landmarks and features."""
    count, landmarks = len(views.views), views.landmarks
    given = count + len(landmarks.point)
    point = np.concatenate([np.zeros(count, int), 1 + landmarks.point, 1 + len(views.names) + features.point])
    view = np.concatenate([np.arange(count), landmarks.view, features.view])
    pixels = np.concatenate([[view.tip_px for view in views.views], landmarks.pixels, features.pixels])
    start = _start(views, point, view, pixels)
    distance = np.linalg.norm(views.touched_mm - start.centres_mm, axis=1).mean()
    known = np.tile((_LOOSE * distance) ** 2 * np.eye(3), (len(start.points_mm), 1, 1))
    known[0] = views.touched_covariance_mm2
    return Problem(
        cameras=tuple(view.camera for view in views.views),
        poses=tuple(view.room_from_camera for view in views.views),
        hand_eye_covariance=views.hand_eye_covariance,
        point=point,
        view=view,
        pixels=pixels,
        sigma_px=np.concatenate(
            [
                np.full(count, views.tip_sigma_px),
                np.full(len(landmarks.point), landmarks.sigma_px),
                np.full(len(features.point), features.sigma_px),
            ]
        ),
        # What a person gave is never silently set aside; it is flagged.
        cut=np.concatenate([np.full(given, np.inf), np.full(len(features.point), _CUT)]),
        known_mm=start.points_mm,
        known_covariance_mm2=known,
    ), start


def _start(views: ViewSet, point: IntArray, view: IntArray, pixels: FloatArray) -> State:
    """Poses as measured, and every point as far before the first scope that sees it as the touched one."""
    poses = [_rolled(views, number) for number in range(len(views.views))]
    rotations = np.stack([pose.rotation for pose in poses])
    centres = np.stack([pose.translation_mm for pose in poses])
    _, first = np.unique(point, return_index=True)
    points = np.tile(views.touched_mm, (len(first), 1))
    for number, one in enumerate(views.views):
        rows = first[view[first] == number]
        rays = directions(one.camera, pixels[rows]) @ rotations[number].T
        depth = max(float((views.touched_mm - centres[number]) @ rotations[number][:, 2]), 10.0)
        points[point[rows]] = centres[number] + depth * rays / (rays @ rotations[number][:, 2])[:, None]
    points[0] = views.touched_mm
    return State(rotations, centres, np.zeros(6), points)


def _rolled(views: ViewSet, number: int) -> RigidTransform:
    """The measured pose; where its roll is as good as unknown, turned until the touched point is where it is seen."""
    view = views.views[number]
    pose = view.room_from_camera
    assert pose.covariance is not None  # a view has one
    axis = pose.rotation[:, 2]
    if axis @ pose.covariance[:3, :3] @ axis < _UNKNOWN_ROLL_RAD**2:
        return pose
    to = (views.touched_mm - pose.translation_mm) @ pose.rotation
    seen = directions(view.camera, view.tip_px[None])[0]
    roll = float(np.arctan2(to[1], to[0]) - np.arctan2(seen[1], seen[0]))
    turned = pose.rotation @ Rotation.from_rotvec([0.0, 0.0, roll]).as_matrix()
    return RigidTransform(pose.target, pose.source, turned, pose.translation_mm, pose.covariance)


def _observed(views: ViewSet, solution: Solution, worst_mm: float) -> tuple[Observation, ...]:
    """All landmarks, the touched point, and those features whose error bar is not longer than `worst_mm`."""
    points, covariance = solution.state.points_mm, solution.of_points
    named, unnamed = slice(1, 1 + len(views.names)), np.arange(1 + len(views.names), len(points))
    found = landmark_observations(views.names, points[named], covariance[named])
    found += (observation("surface", "touched point", points[:1], covariance[:1]),)
    good = unnamed[np.linalg.eigvalsh(covariance[unnamed])[:, -1] <= worst_mm**2]
    if len(good):
        found += (observation("surface", "features", points[good], covariance[good]),)
    return found
