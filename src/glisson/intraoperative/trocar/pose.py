"""The pose of a trocar's camera from corners of crosses: global, with covariance, and with its doubts told."""

from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.refinement import RefinedPose, refined_pose, turn
from glisson.intraoperative.trocar.uncertainty import loosened, pose_covariance

CONFIDENCE = 0.9999
_BOUND = float(np.sqrt(chi2.ppf(CONFIDENCE, 3)))
_OFF = float(chi2.ppf(0.9999999, 2))
"""A corner that errs by more (squared, in units of its covariance) is none: one of ten million would be."""

_MEDIAN_SQUARE = 2.0 * np.log(2.0)
"""Median of the squared error of a corner, in units of its covariance."""

_WORSE = 5.0
"""Corners may err by this factor more than is stated of them; the covariance counts that."""

_CLEARLY_WORSE = 50.0
"""A second pose whose squared error is larger by this is e²⁵ times less likely."""

_APART = 20.0
"""A second pose this far away, squared, in units of the first one's covariance, is another one."""

_SOFT, _REWEIGHTED = 9.0, 4
"""Corners with larger squared errors weigh less; so often are they weighted anew."""

_GUESSES = 40
"""Pairs of crosses that are tried at most for a pose with which the others agree."""


@dataclass(frozen=True, eq=False)
class FoundPose:
    """`camera_from_room` with covariance, the corners that agree (a mask), and a second pose that fits as well.

    `scale` is the ratio of the residual to the corners' stated standard deviations, one at least. Position (mm) and
    orientation (rad) exceed the bounds in one of 10,000 cases.
    """

    camera_from_room: RigidTransform
    agree: NDArray[np.bool_]
    scale: float
    bound_mm: float
    bound_rad: float
    second: RigidTransform | None = None


def pose_from_corners(seen: SeenCorners, camera: Camera, layout: CrossLayout) -> FoundPose | None:
    """The pose with which most corners agree; None where no two crosses agree on one.

    SQPnP (Terzakis and Lourakis 2020) needs no guess. Where the corners do not all agree, it is tried on pairs of
    crosses. The covariance counts the corners' noise, scaled by the residual where that is larger, and what the
    camera's calibration and the places of the crosses leave open.

    Args:
        seen: corners.
        camera: has taken the image.
        layout: to which the corners' numbers refer.
    """
    if len(seen.crosses) < 2:
        return None
    agreed = _agreed(seen, camera, layout)
    if agreed is None:
        return None
    found = with_covariance(agreed.pose, seen, agreed.weighted, agreed.agree, camera, layout)
    return replace(found, second=_second(agreed.pose, agreed.weighted.of(agreed.agree), found))


def with_covariance(
    pose: RefinedPose,
    seen: SeenCorners,
    weighted: SeenCorners,
    agree: NDArray[np.bool_],
    camera: Camera,
    layout: CrossLayout,
) -> FoundPose:
    """A refined pose by the corners that agree (n,), with covariance and bounds; `weighted` are as it took them."""
    used = seen.of(agree)
    scale = max(1.0, float(np.sqrt(pose.squares.sum() / (2 * len(used) - 6))))
    covariance = pose_covariance(pose, used, weighted.information[agree], scale, camera, layout)
    transform = RigidTransform("camera", "room", pose.rotation, pose.translation_mm, covariance)
    bound_mm, bound_rad = _bounds(transform)
    return FoundPose(transform, agree, scale, bound_mm, bound_rad)


def _bounds(camera_from_room: RigidTransform) -> tuple[float, float]:
    """What position (mm) and orientation (rad) exceed in one of 10,000 cases."""
    covariance = camera_from_room.inverse().covariance
    assert covariance is not None
    place = np.sqrt(np.linalg.eigvalsh(covariance[3:, 3:])[-1])
    angle = np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[-1])
    return float(_BOUND * place), float(_BOUND * angle)


class _Agreed(NamedTuple):
    """A pose, the corners as they were weighted, and which of them agree with it."""

    pose: RefinedPose
    weighted: SeenCorners
    agree: NDArray[np.bool_]


def _agreed(seen: SeenCorners, camera: Camera, layout: CrossLayout) -> _Agreed | None:
    """The pose with which most corners agree."""
    agreed = None
    if (guess := global_pose(seen)) is not None:
        agreed = _grown(loosened(seen, guess, camera, layout), guess)
    if agreed is not None:
        return agreed
    best, best_count = None, 0
    for pair in _pairs(seen):
        if (guess := global_pose(seen.of(np.isin(seen.cross, pair)))) is not None:
            count = int((_squares(loosened(seen, guess, camera, layout), guess) < _OFF).sum())
            best, best_count = (guess, count) if count > best_count else (best, best_count)
    return None if best is None else _grown(loosened(seen, best, camera, layout), best)


def _grown(weighted: SeenCorners, guess: RefinedPose) -> _Agreed | None:
    """The pose by the corners that agree, from a guess by all corners of which false ones weigh less and less."""
    pose = guess
    for _ in range(_REWEIGHTED):
        # Geman and McClure's weights.
        weights = 1.0 / (1.0 + _squares(weighted, pose) / _SOFT) ** 2
        pose = _refined(replace(weighted, information=weighted.information * weights[:, None, None]), pose)
    agree = _agreeing(weighted, pose)
    for _ in range(_REWEIGHTED):
        crosses, counts = np.unique(weighted.cross[agree], return_counts=True)
        # Most of the corners must agree, and of most of the crosses some: half of them might tell another pose.
        if (counts >= 3).sum() < 2 or 2 * len(crosses) <= len(weighted.crosses) or 2 * agree.sum() <= len(agree):
            return None
        pose = _refined(weighted.of(agree), pose)
        before, agree = agree, _agreeing(weighted, pose)
        if (agree == before).all():
            return _Agreed(pose, weighted, agree)
    return None


def _agreeing(seen: SeenCorners, pose: RefinedPose) -> NDArray[np.bool_]:
    """Which corners (n,) agree with a pose; where most err by more than they should, the limit is wider by as much."""
    squares = _squares(seen, pose)
    typical = float(np.median(squares)) / _MEDIAN_SQUARE
    return np.asarray(squares < _OFF * min(max(1.0, typical), _WORSE**2))


def _refined(seen: SeenCorners, pose: RefinedPose) -> RefinedPose:
    return refined_pose(seen.points_mm, seen.slopes, seen.information, pose.rotation, pose.translation_mm)


def _pairs(seen: SeenCorners) -> list[tuple[int, int]]:
    """Pairs of crosses, those with most corners first."""
    counts = {number: int((seen.cross == number).sum()) for number in seen.crosses}
    pairs = sorted(combinations(seen.crosses, 2), key=lambda pair: -min(counts[pair[0]], counts[pair[1]]))
    return pairs[:_GUESSES]


def global_pose(seen: SeenCorners) -> RefinedPose | None:
    """The pose of least squared error over all corners, without a guess."""
    if len(seen) < 6:
        return None
    middle = seen.points_mm.mean(axis=0)
    found, poses, shifts, _ = cv2.solvePnPGeneric(
        seen.points_mm - middle, seen.slopes, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP
    )
    best: RefinedPose | None = None
    for turned, shift in zip(poses[:found], shifts[:found], strict=True):
        rotation = turn(np.asarray(turned, dtype=np.float64).ravel())
        pose = refined_pose(seen.points_mm, seen.slopes, seen.information, rotation, shift.ravel() - rotation @ middle)
        if np.isfinite(pose.squares).all() and (best is None or pose.squares.sum() < best.squares.sum()):
            best = pose
    return best


def _squares(seen: SeenCorners, pose: RefinedPose) -> FloatArray:
    """Squared errors (n,) of all corners in units of their covariance; infinite behind the camera."""
    in_camera = seen.points_mm @ pose.rotation.T + pose.translation_mm
    before = in_camera[:, 2] > 1e-6
    errors = in_camera[:, :2] / np.where(before, in_camera[:, 2], 1.0)[:, None] - seen.slopes
    squares = np.einsum("ni,nij,nj->n", errors, seen.information, errors)
    return np.asarray(np.where(before, squares, np.inf))


def _second(pose: RefinedPose, used: SeenCorners, found: FoundPose) -> RigidTransform | None:
    """The other minimum of points that lie nearly in a plane, where it is not clearly worse.

    It is near to where the plane is mirrored at the line of sight to its middle (Schweighofer and Pinz 2006).
    """
    middle = used.points_mm.mean(axis=0)
    sight = pose.rotation @ middle + pose.translation_mm
    sight = sight / np.linalg.norm(sight)
    _, axes = np.linalg.eigh(np.cov(used.points_mm.T))
    normal = pose.rotation @ axes[:, 0]
    axis = np.cross(normal, sight) * np.sign(normal @ sight)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        return None
    tilted = turn(2.0 * np.arcsin(min(sine, 1.0)) / sine * axis) @ pose.rotation
    shift = pose.rotation @ middle + pose.translation_mm - tilted @ middle
    other = refined_pose(used.points_mm, used.slopes, used.information, tilted, shift)
    worse = (other.squares.sum() - pose.squares.sum()) / found.scale**2
    if not worse < _CLEARLY_WORSE:
        return None
    turned, _ = cv2.Rodrigues(other.rotation @ pose.rotation.T)
    step = np.concatenate([turned.ravel(), other.translation_mm - pose.translation_mm])
    covariance = found.camera_from_room.covariance
    if covariance is not None and step @ np.linalg.solve(covariance, step) < _APART:
        return None
    its_own = np.asarray(np.linalg.inv(other.normal) * found.scale**2, dtype=np.float64)
    return RigidTransform("camera", "room", other.rotation, other.translation_mm, its_own)
