"""The geometry of a scope: where its glass tip and shaft are before the camera, and how oblique it looks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.transform import RigidTransform, cross_matrix
from glisson.intraoperative.cameras.turning import turning

_TURNED_DEG = 20.0
_BEHIND_MM, _BEFORE_MM, _ASIDE_MM, _SIGMAS = 2.0, 30.0, 20.0, 3.0
"""No scope's glass tip is farther from its centre of projection than this, and so many standard deviations."""


@dataclass(frozen=True, eq=False)
class Shaft:
    """The line about which a scope was spun.

    Args:
        direction: unit vector (3,) along it in the marker's frame.
        point_mm: its point (3,) nearest to the marker's origin.
        covariance: (3, 3) of the direction, without units.
        rms_deg: root mean square angle between the directions of single poses and the mean.
    """

    direction: FloatArray
    point_mm: FloatArray
    covariance: FloatArray
    rms_deg: float


def calibrate_shaft(room_from_marker: Sequence[RigidTransform]) -> Shaft:
    """The shaft from poses taken while the scope is spun about it in a sleeve or groove.

    The direction a of the shaft in the marker's frame and b in the room are those with R a = b in all poses: the
    singular vectors of the mean rotation with the greatest singular value. The scope may slide along.

    Raises:
        BadInput: fewer than five poses.
        StageFailed: unobservable (hardly spun), or the poses turn about more than one axis.
    """
    if len(room_from_marker) < 5:
        raise BadInput(
            f"These are too few poses to find the shaft ({len(room_from_marker)}); spin the scope through 20 or more."
        )
    rotations = np.stack([pose.rotation for pose in room_from_marker])
    turned = turning(list(rotations))
    if turned.about_first_deg < _TURNED_DEG:
        raise StageFailed(
            f"The scope was spun by {turned.about_first_deg:.1f}° only; spin it by 90° or more.", Status.UNOBSERVABLE
        )
    if turned.about_second_deg > 0.3 * turned.about_first_deg:
        raise StageFailed(
            "The scope turned about more than its shaft; hold it in a sleeve or groove and spin it there.",
            Status.STAGNATED,
        )
    left, _, right = np.linalg.svd(rotations.mean(axis=0))
    direction = right[0]
    off = (rotations @ direction) @ left[:, 1:]
    across_room, across = left[:, 1:], right[1:]
    jacobian = np.concatenate(
        [across_room.T @ rotations @ across.T, np.broadcast_to(-np.eye(2), (len(rotations), 2, 2))], axis=2
    ).reshape(-1, 4)
    variance = float((off**2).sum()) / max(off.size - 4, 1)
    own = variance * np.linalg.inv(jacobian.T @ jacobian)[:2, :2]
    return Shaft(
        direction,
        _nearest_point(room_from_marker, across, across_room),
        across.T @ own @ across,
        float(np.degrees(np.sqrt((off**2).sum(axis=1).mean()))),
    )


def _nearest_point(poses: Sequence[RigidTransform], across: FloatArray, across_room: FloatArray) -> FloatArray:
    """The point of the shaft across from the marker's origin, which stays on one line in the room."""
    rows = np.concatenate([np.hstack([across_room.T @ pose.rotation @ across.T, -np.eye(2)]) for pose in poses])
    right = np.concatenate([-across_room.T @ pose.translation_mm for pose in poses])
    found = np.linalg.lstsq(rows, right, rcond=None)[0]
    point: FloatArray = found[:2] @ across
    return point


@dataclass(frozen=True, eq=False)
class Scope:
    """What a scope's camera has before it, in the frame "camera" (its origin is the centre of projection).

    Args:
        tip_mm: the glass tip (3,).
        tip_covariance_mm2: (3, 3).
        shaft: unit vector (3,) along the shaft towards the tip; None where it was not measured.
        oblique_deg: angle between optical axis and shaft, 30 for a 30° scope; None likewise.
        oblique_sigma_deg: its standard deviation.
        tip_off_shaft_mm: distance of the tip from the shaft's line; None likewise.
    """

    tip_mm: FloatArray
    tip_covariance_mm2: FloatArray
    shaft: FloatArray | None
    oblique_deg: float | None
    oblique_sigma_deg: float | None
    tip_off_shaft_mm: float | None


def scope_geometry(
    camera_from_marker: RigidTransform, tip_mm: FloatArray, tip_covariance_mm2: FloatArray, shaft: Shaft | None
) -> Scope:
    """The geometry of a scope.

    Args:
        camera_from_marker: hand–eye pose, with covariance.
        tip_mm: the glass tip in the marker's frame (3,), by `calibrate_pivot` or as known.
        tip_covariance_mm2: (3, 3).
        shaft: the shaft in the marker's frame, if it was measured.

    Raises:
        BadInput: the tip lies where no scope has it.
    """
    tip = camera_from_marker.apply(tip_mm)
    covariance = camera_from_marker.point_covariance(tip_mm, tip_covariance_mm2)
    _check_tip(tip, covariance)
    if shaft is None:
        return Scope(tip, covariance, None, None, None, None)
    along = shaft.direction * np.sign(float((tip_mm - shaft.point_mm) @ shaft.direction) or 1.0)
    direction = camera_from_marker.rotation @ along
    off = (tip_mm - shaft.point_mm) - ((tip_mm - shaft.point_mm) @ along) * along
    spread = camera_from_marker.rotation @ shaft.covariance @ camera_from_marker.rotation.T
    if camera_from_marker.covariance is not None:
        arm = cross_matrix(direction)
        spread = spread + arm @ camera_from_marker.covariance[:3, :3] @ arm.T
    # The angle changes with what the direction does towards or away from the optical axis.
    away = np.array([direction[0], direction[1], 0.0])
    sine = float(np.linalg.norm(away))
    towards = np.array([away[0], away[1], 0.0]) / sine * direction[2] if sine > 1e-9 else np.array([1.0, 0.0, 0.0])
    towards[2] = -sine
    return Scope(
        tip, covariance, direction,
        float(np.degrees(np.arctan2(sine, direction[2]))),
        float(np.degrees(np.sqrt(towards @ spread @ towards))),
        float(np.linalg.norm(off)),
    )  # fmt: skip


def _check_tip(tip_mm: FloatArray, covariance_mm2: FloatArray) -> None:
    depth, aside = float(tip_mm[2]), float(np.linalg.norm(tip_mm[:2]))
    slack = _SIGMAS * float(np.sqrt(np.linalg.eigvalsh(covariance_mm2)[-1]))
    if -_BEHIND_MM - slack <= depth <= _BEFORE_MM + slack and aside <= _ASIDE_MM + slack:
        return
    raise BadInput(
        f"The glass tip would lie {abs(depth):.0f} mm {'before' if depth > 0.0 else 'behind'} the centre of projection "
        f"and {aside:.0f} mm beside the optical axis: are the tip and the hand–eye pose of the same marker, in mm?"
    )
