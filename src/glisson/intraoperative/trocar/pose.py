"""The pose of a trocar's camera from corners of crosses: global, with covariance, and with its doubts told."""

from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import CrossLayout
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import project_with_jacobian
from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.refinement import RefinedPose, refined_pose, turn

CONFIDENCE = 0.9999
_BOUND = float(np.sqrt(chi2.ppf(CONFIDENCE, 3)))
_OFF = float(chi2.ppf(0.9999999, 2))
"""A corner that errs by more (squared, in units of its covariance) is none: one of ten million would be."""

_CLEARLY_WORSE = 50.0
"""A second pose whose squared error is larger by this is e²⁵ times less likely."""

_APART = 20.0
"""A second pose this far away, squared, in units of the first one's covariance, is another one."""

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
    agreed = _agreed(seen)
    if agreed is None:
        return None
    pose, agree = agreed
    found = with_covariance(pose, seen, agree, camera, layout)
    return replace(found, second=_second(pose, seen.of(agree), found))


def with_covariance(
    pose: RefinedPose, seen: SeenCorners, agree: NDArray[np.bool_], camera: Camera, layout: CrossLayout
) -> FoundPose:
    """A refined pose by the corners that agree (n,), with covariance and bounds."""
    used = seen.of(agree)
    scale = max(1.0, float(np.sqrt(pose.squares.sum() / (2 * len(used) - 6))))
    covariance = np.linalg.inv(pose.normal) * scale**2 + _unmodelled(pose, used, camera, layout)
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


def _agreed(seen: SeenCorners) -> tuple[RefinedPose, NDArray[np.bool_]] | None:
    """The pose with which most corners agree, and which these are."""
    everything = np.ones(len(seen), dtype=bool)
    pose = global_pose(seen)
    if pose is not None and (pose.squares < _OFF).all():
        return pose, everything
    best = everything & False
    for pair in _pairs(seen):
        guess = global_pose(seen.of(np.isin(seen.cross, pair)))
        if guess is not None:
            agree = _squares(seen, guess) < _OFF
            best = agree if agree.sum() > best.sum() else best
    return _grown(seen, best)


def _grown(seen: SeenCorners, agree: NDArray[np.bool_]) -> tuple[RefinedPose, NDArray[np.bool_]] | None:
    """The pose by the corners that agree, over and over until these stay the same."""
    for _ in range(5):
        crosses, counts = np.unique(seen.cross[agree], return_counts=True)
        # Of most crosses that are seen at least half of the corners must agree.
        if (counts >= 3).sum() < 2 or 2 * len(crosses) < len(seen.crosses) or 2 * agree.sum() < len(seen):
            return None
        pose = global_pose(seen.of(agree))
        if pose is None:
            return None
        now = _squares(seen, pose) < _OFF
        if (now == agree).all():
            return pose, agree
        agree = now
    return None


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
        rotation = turn(turned.ravel())
        pose = refined_pose(
            seen.points_mm, seen.slopes, seen.information, rotation, shift.ravel() - rotation @ middle
        )
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
    if step @ np.linalg.solve(found.camera_from_room.covariance, step) < _APART:
        return None
    return RigidTransform("camera", "room", other.rotation, other.translation_mm, np.linalg.inv(other.normal) * found.scale**2)


def _unmodelled(pose: RefinedPose, used: SeenCorners, camera: Camera, layout: CrossLayout) -> FloatArray:
    """Covariance (6, 6) that errors of the calibration and of the crosses' places leave in the pose."""
    total = np.zeros((6, 6))
    known = {number: layout.crosses[number].room_from_cross for number in used.crosses}
    if camera.covariance is None and all(one.covariance is None for one in known.values()):
        return total
    transform = RigidTransform("camera", "room", pose.rotation, pose.translation_mm)
    _, by_all = project_with_jacobian(camera, transform, used.points_mm)
    focal = np.diag(camera.focal_px)
    weights = np.linalg.solve(focal, used.information) @ np.linalg.inv(focal)  # per px²
    gain = np.linalg.solve(pose.normal, np.einsum("npi,npq->inq", by_all[:, :, :6], weights).reshape(6, -1))
    if camera.covariance is not None:
        of_camera = gain @ by_all[:, :, 6:].reshape(-1, 9)
        total += of_camera @ camera.covariance @ of_camera.T
    for number, place in known.items():
        if place.covariance is not None:
            total += _of_place(pose, used, by_all, gain, number, place)
    return total


def _of_place(
    pose: RefinedPose, used: SeenCorners, by_all: FloatArray, gain: FloatArray, number: int, place: RigidTransform
) -> FloatArray:
    """What the error of one cross's place leaves in the pose (6, 6)."""
    rows = np.flatnonzero(used.cross == number)
    arms = used.points_mm[rows] - place.translation_mm
    zero = np.zeros(len(rows))
    turned = np.stack(
        [
            np.stack([zero, arms[:, 2], -arms[:, 1]], axis=1),
            np.stack([-arms[:, 2], zero, arms[:, 0]], axis=1),
            np.stack([arms[:, 1], -arms[:, 0], zero], axis=1),
        ],
        axis=1,
    )
    moved = np.concatenate([turned, np.broadcast_to(np.eye(3), turned.shape)], axis=2)
    by_place = by_all[rows, :, 3:6] @ (pose.rotation @ moved)
    part = gain.reshape(6, -1, 2)[:, rows].reshape(6, -1) @ by_place.reshape(-1, 6)
    spread: FloatArray = part @ place.covariance @ part.T
    return spread
