"""A line drawn on the organ becomes a resection plane, or a surface that goes in from the line."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, unit_vector
from glisson.core.errors import BadInput
from glisson.core.mesh import TriangleSurface
from glisson.core.status import Status
from glisson.core.structures import Plane
from glisson.core.tip_track import TipTrack
from glisson.geometry.planes import fit_plane, plane_basis

_ROUNDS = 20
_TILT_DEG = 10.0
"""A plane whose tilt is known to no better (one standard deviation) is none."""
_ACROSS_DEG, _SIGMAS = 5.0, 3.0
"""A direction nearer to the plane than this, or than so many standard deviations of its tilt, tells no side."""


@dataclass(frozen=True, eq=False)
class DrawnPlane:
    """A plane through a drawn line.

    Args:
        plane: its point is the middle of the line.
        covariance: (3, 3) of two small turns (rad) about `geometry.planes.plane_basis`, and of the offset (mm).
        rms_mm: of the tips' distances from it.
        misfit: their squared distances in units of their variances, per degree of freedom; far over 1 no plane fits.
    """

    plane: Plane
    covariance: FloatArray
    rms_mm: float
    misfit: float

    @property
    def tilt_sigma_rad(self) -> float:
        """Standard deviation of the tilt about the axis that is known least."""
        return float(np.sqrt(np.linalg.eigvalsh(self.covariance[:2, :2])[-1]))

    @property
    def status(self) -> Status:
        """Unobservable where the line, nearly straight, leaves the tilt open."""
        return Status.CONVERGED if self.tilt_sigma_rad < np.radians(_TILT_DEG) else Status.UNOBSERVABLE


def plane_of(track: TipTrack, towards: FloatArray) -> DrawnPlane:
    """The most likely plane through a line drawn on the organ, each tip weighted by its error along the normal.

    A line on a curved organ spans a plane; on a flat one it does not, and the covariance says so. An error that all
    tips share does not tilt the plane but shifts it, so that its offset is no surer than one tip.

    Args:
        track: the line, smoothed or not.
        towards: a direction (3,) to the side that is removed.

    Raises:
        BadInput: fewer than three tips, all on one line, or a direction that is zero or does not tell the side.
    """
    towards = unit_vector(towards, "The direction to the removed side")
    plane = fit_plane(track.points_mm, towards).plane
    for _ in range(_ROUNDS):
        rows, off, variances, middle = _equations(track, plane)
        information = (rows / variances[:, None]).T @ rows
        change = np.linalg.solve(information, (rows / variances[:, None]).T @ off)
        u, v = plane_basis(plane)
        turned = plane.normal + change[0] * np.cross(u, plane.normal) + change[1] * np.cross(v, plane.normal)
        plane = Plane(middle + change[2] * plane.normal, turned)
        if np.abs(change).max() < 1e-9:
            break
    rows, off, variances, _ = _equations(track, plane)
    free = len(track) - 3
    misfit = float((off**2 / variances).sum()) / free if free else 0.0
    information = (rows / variances[:, None]).T @ rows
    covariance = np.asarray(np.linalg.inv(information) * max(misfit, 1.0), dtype=np.float64)
    covariance[2, 2] += 1.0 / float(np.mean(1.0 / variances))
    drawn = DrawnPlane(plane, covariance, float(np.sqrt(np.mean(off**2))), misfit)
    across_deg = float(np.degrees(np.arcsin(min(abs(float(towards @ plane.normal)), 1.0))))
    if drawn.status.is_good and across_deg < max(_ACROSS_DEG, _SIGMAS * np.degrees(drawn.tilt_sigma_rad)):
        raise BadInput(
            f"The direction to the removed side is {across_deg:.1f}° off the drawn plane, which is known to "
            f"{np.degrees(drawn.tilt_sigma_rad):.1f}°, and does not tell the side; give one that goes across it."
        )
    return drawn


def _equations(track: TipTrack, plane: Plane) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """How distances (n,) change by turns and offset (n, 3), the distances, their variances, the line's middle (3,)."""
    variances = np.einsum("i,nij,j->n", plane.normal, track.covariance_mm2, plane.normal)
    middle = np.average(track.points_mm, axis=0, weights=1.0 / variances)
    middle = middle - float(plane.distance_mm(middle)) * plane.normal
    away = track.points_mm - middle
    u, v = plane_basis(plane)
    # A turn about u moves the normal by u × n; the offset moves the plane along it.
    rows = np.stack([-away @ np.cross(u, plane.normal), -away @ np.cross(v, plane.normal), np.ones(len(away))], axis=1)
    return rows, away @ plane.normal, variances, middle


def surface_of(track: TipTrack, into: FloatArray, depth_mm: float) -> TriangleSurface:
    """The ruled surface (open) from a line drawn on the organ straight in by a depth.

    Args:
        track: the smoothed line of at least two tips.
        into: direction (3,) into the organ.
        depth_mm: how far.

    Raises:
        BadInput: fewer than two tips, no direction or no depth.
    """
    if len(track) < 2:
        raise BadInput("A resection surface needs a line of two tips at least.")
    if not 0.0 < depth_mm < np.inf:
        raise BadInput(f"A resection surface needs a depth of more than 0 mm, not {depth_mm} mm.")
    deep = track.points_mm + depth_mm * unit_vector(into, "the direction of the resection")
    count = len(track)
    first = np.arange(count - 1)
    upper = np.stack([first, first + 1, first + count], axis=1)
    lower = np.stack([first + 1, first + count + 1, first + count], axis=1)
    return TriangleSurface(np.concatenate([track.points_mm, deep]), np.concatenate([upper, lower]))
