"""Pivot calibration: the tip of a tracked tool from poses taken while it turns about its resting tip."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform, cross_matrix
from glisson.intraoperative.cameras.turning import turning
from glisson.intraoperative.cameras.variance_components import Blocks

_TURNED_DEG = 5.0
_OUTLYING = 6.0
_MEDIAN_NORM = 1.5382
"""Median length of a vector of three normal deviates."""


@dataclass(frozen=True, eq=False)
class Pivot:
    """Where the tip is.

    Args:
        tip_mm: in the frame of the marker (3,).
        pivot_mm: the point about which it turned, in the tracker's frame (3,).
        covariance_mm2: (6, 6) of tip and pivot.
        rms_mm: root mean square distance of the tip from the pivot point over the poses that were used.
        rms_all_mm: the same over all poses.
        used: which poses (n,) were used; the others are outliers.
        residuals_mm: tip minus pivot point (n, 3), in the tracker's frame.
        tracker_sigma_deg: standard deviation of the tracked angle about each axis, as the residuals show it.
        tracker_sigma_mm: standard deviation of each tracked coordinate.
        turned_deg: root mean square angles between poses about the two main axes.
        notes: sentences on what a person should look at.
    """

    tip_mm: FloatArray
    pivot_mm: FloatArray
    covariance_mm2: FloatArray
    rms_mm: float
    rms_all_mm: float
    used: NDArray[np.bool_]
    residuals_mm: FloatArray
    tracker_sigma_deg: float
    tracker_sigma_mm: float
    turned_deg: tuple[float, float]
    notes: tuple[str, ...]


def calibrate_pivot(room_from_marker: Sequence[RigidTransform]) -> Pivot:
    """Tip and pivot point from R p + t = q in all poses (algebraic one-step method; Yaniv 2015).

    It starts from the least sum of distances, which outliers hardly move; poses 6 standard deviations away are left
    out. Errors of angle act on the tip through the tool's length, those of place do not: both are estimated, and the
    poses weighted by them.

    Raises:
        BadInput: fewer than five poses.
        StageFailed: unobservable (hardly turned, or about one axis only), or no point fits most of the poses.
    """
    if len(room_from_marker) < 5:
        raise BadInput(f"These are too few poses for a pivot calibration ({len(room_from_marker)}); take 20 or more.")
    rotations = np.stack([pose.rotation for pose in room_from_marker])
    shifts = np.stack([pose.translation_mm for pose in room_from_marker])
    turned = turning(list(rotations))
    if turned.about_second_deg < _TURNED_DEG:
        raise StageFailed(
            f"The poses are nearly parallel: the tool was turned by {turned.about_first_deg:.1f}° about one axis and "
            f"{turned.about_second_deg:.1f}° about another; swing it by 20° or more both ways.",
            Status.UNOBSERVABLE,
        )
    jacobian = np.concatenate([rotations, np.broadcast_to(-np.eye(3), rotations.shape)], axis=2)
    used = _inliers(jacobian, shifts)
    found, covariance, sigma_rad, sigma_mm = _weighted(rotations[used], jacobian[used], shifts[used])
    residuals = jacobian @ found + shifts
    squares = (residuals**2).sum(axis=1)
    rms = float(np.sqrt(squares[used].mean()))
    return Pivot(
        found[:3], found[3:], covariance, rms, float(np.sqrt(squares.mean())), used, residuals,
        float(np.degrees(sigma_rad)), sigma_mm, (turned.about_first_deg, turned.about_second_deg),
        _notes(used, covariance, rms),
    )  # fmt: skip


def _inliers(jacobian: FloatArray, shifts: FloatArray) -> NDArray[np.bool_]:
    """Poses that fit the solution with the least sum of distances, by repeated weighting (Weiszfeld)."""
    weights = np.ones(len(shifts))
    for _ in range(50):
        root = np.sqrt(weights)[:, None]
        rows = (jacobian * root[:, :, None]).reshape(-1, 6)
        found = np.linalg.lstsq(rows, -(shifts * root).ravel(), rcond=None)[0]
        distances = np.linalg.norm(jacobian @ found + shifts, axis=1)
        weights = 1.0 / np.maximum(distances, 1e-3)
    sigma = max(float(np.median(distances)) / _MEDIAN_NORM, 1e-6)
    used: NDArray[np.bool_] = distances < _OUTLYING * sigma
    if used.sum() < max(5, 0.6 * len(used)):
        raise StageFailed(
            f"Only {used.sum()} of {len(used)} poses fit one pivot point; rest the tip in a hole and try again.",
            Status.STAGNATED,
        )
    return used


def _weighted(
    rotations: FloatArray, jacobian: FloatArray, shifts: FloatArray
) -> tuple[FloatArray, FloatArray, float, float]:
    """Tip and pivot (6,), their covariance, and the tracker's standard deviations in rad and mm."""
    found = np.asarray(np.linalg.lstsq(jacobian.reshape(-1, 6), -shifts.ravel(), rcond=None)[0], dtype=np.float64)
    sizes = np.array([1e-3, 1.0])
    for _ in range(3):
        arms = np.stack([cross_matrix(rotation @ found[:3]) for rotation in rotations])
        parts = np.stack([arms @ arms.transpose(0, 2, 1), np.broadcast_to(np.eye(3), arms.shape)])
        blocks = Blocks(-shifts - jacobian @ found, jacobian, np.zeros(arms.shape), parts, np.zeros((6, 6)))
        sizes = blocks.sizes(sizes[None])
        step, normal = blocks.solved(sizes)
        found = found + step
    return found, blocks.covariance(normal), float(sizes[0]), float(sizes[1])


def _notes(used: NDArray[np.bool_], covariance: FloatArray, rms_mm: float) -> tuple[str, ...]:
    notes = []
    left_out = np.flatnonzero(~used)
    if len(left_out):
        numbers = ", ".join(str(number + 1) for number in left_out[:8]) + (" …" if len(left_out) > 8 else "")
        notes.append(f"{len(left_out)} of {len(used)} poses were left out as outliers, counted from 1: {numbers}.")
    sigma = float(np.sqrt(np.linalg.eigvalsh(covariance[:3, :3])[-1]))
    if sigma > 1.0:
        notes.append(f"The tip is known to {sigma:.1f} mm only (one standard deviation): swing the tool further.")
    if rms_mm > 1.5:
        notes.append(
            f"The poses scatter by {rms_mm:.1f} mm about the pivot point: the tip slipped or the marker is bent."
        )
    return tuple(notes)
