"""The wire from a scan's centreline or from tracked positions of its tip."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.observations import Observation
from glisson.core.structures import Curve
from glisson.intraoperative.wire.smooth_curve import smooth_curve


def curve_from_scan(centreline: Curve, sigma_mm: float, name: str = "wire", frame: str = "patient") -> Observation:
    """A centreline of a CT or CBCT, each coordinate with a standard deviation of `sigma_mm` (about half a voxel)."""
    points = centreline.points_mm
    covariance = np.tile(sigma_mm**2 * np.eye(3), (len(points), 1, 1))
    return Observation("curve", name, points, sigma_mm, frame, covariance_mm2=covariance)


def curve_from_tips(
    times_s: FloatArray,
    tips_mm: FloatArray,
    covariance_mm2: FloatArray,
    name: str = "wire",
    frame: str = "room",
    spacing_mm: float = 10.0,
) -> Observation:
    """The way of a tracked tip that is drawn along the duct, smoothed.

    Args:
        times_s: (n,) increasing.
        tips_mm: (n, 3).
        covariance_mm2: (n, 3, 3).
        name: of the structure.
        frame: of the positions.
        spacing_mm: what bends within less is smoothed away.

    Raises:
        BadInput: fewer than four positions, times that do not increase, or a tip that did not move.
        StageFailed: the positions contradict every smooth curve.
    """
    reach = np.linalg.norm(np.ptp(tips_mm, axis=0)) if len(tips_mm) else 0.0
    if reach < spacing_mm:
        raise BadInput(f"The tip moved by {reach:.1f} mm only; a curve needs {spacing_mm:g} mm or more.")
    found = smooth_curve(times_s, tips_mm, covariance_mm2, spacing_mm)
    found.require_fit()
    return found.observation(name, frame, float(times_s[-1]))
