"""A smooth curve through points with covariance: cubic B-splines by weighted least squares."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.observations import Observation
from glisson.core.status import Status

_DEGREE = 3
_STIFFNESS_MM = 30.0
"""Neighbouring control points bend by no more than about this (one standard deviation): it only bridges gaps."""

_DOUBT = 1e-4


@dataclass(frozen=True, eq=False)
class SmoothCurve:
    """Points (n, 3) in mm evenly along the curve with covariance (n, 3, 3), and how likely the fit's residuals are."""

    points_mm: FloatArray
    covariance_mm2: FloatArray
    chance: float

    def require_fit(self) -> None:
        """Refuse a curve that its own points contradict.

        Raises:
            StageFailed: the points are farther from every smooth curve than their error bars allow.
        """
        if self.chance < _DOUBT:
            raise StageFailed(
                "The points lie farther from a smooth curve than their error bars allow; some are wrong, or the error "
                "bars are too short.",
                Status.AMBIGUOUS,
            )

    def observation(self, name: str, frame: str, time_s: float = 0.0) -> Observation:
        """The curve as an observation that may slide along the structure `name`."""
        sigma = float(np.sqrt(np.trace(self.covariance_mm2, axis1=1, axis2=2).mean() / 3.0))
        return Observation(
            "curve", name, self.points_mm, sigma, frame, time_s=time_s, covariance_mm2=self.covariance_mm2
        )


def smooth_curve(
    parameter: FloatArray, points_mm: FloatArray, covariance_mm2: FloatArray, spacing_mm: float, step_mm: float = 1.0
) -> SmoothCurve:
    """The curve through points (n, 3) with covariance (n, 3, 3).

    Args:
        parameter: where each point is along the curve (n,), in any unit that increases.
        points_mm: the points.
        covariance_mm2: of each, positive definite; errors of different points are independent.
        spacing_mm: between control points; what bends within less is smoothed away.
        step_mm: between the points that are given back.

    Raises:
        BadInput: fewer than four points, or a parameter that does not increase.
    """
    if len(points_mm) < _DEGREE + 1:
        raise BadInput(f"A curve needs at least {_DEGREE + 1} points, not {len(points_mm)}.")
    if not np.isfinite(points_mm).all() or (np.diff(parameter) <= 0.0).any():
        raise BadInput("Points of a curve must be finite, and follow each other along it.")
    share = (parameter - parameter[0]) / (parameter[-1] - parameter[0])
    length = _length_mm(points_mm)
    pieces = int(np.clip(round(length / spacing_mm), 1, max(1, len(points_mm) - _DEGREE)))
    knots = np.concatenate([np.zeros(_DEGREE), np.linspace(0.0, 1.0, pieces + 1), np.ones(_DEGREE)])
    basis = BSpline.design_matrix(np.clip(share, 0.0, 1.0), knots, _DEGREE).toarray()
    weights = np.linalg.inv(covariance_mm2)
    count = basis.shape[1]
    normal = np.einsum("na,nij,nb->aibj", basis, weights, basis).reshape(3 * count, 3 * count)
    bends = np.kron(np.diff(np.eye(count), 2, axis=0), np.eye(3)) / _STIFFNESS_MM
    inverse = np.linalg.inv(normal + bends.T @ bends)
    side = np.einsum("na,nij,nj->ai", basis, weights, points_mm).reshape(-1)
    control = (inverse @ side).reshape(count, 3)
    rests = points_mm - basis @ control
    square = float(np.einsum("ni,nij,nj->", rests, weights, rests))
    freedom = max(3 * len(points_mm) - float(np.trace(inverse @ normal)), 1e-9)
    fine = np.linspace(0.0, 1.0, 2001)
    places = BSpline.design_matrix(fine, knots, _DEGREE) @ control
    arcs = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    even = np.interp(np.linspace(0.0, arcs[-1], max(2, round(arcs[-1] / step_mm) + 1)), arcs, fine)
    rows = BSpline.design_matrix(even, knots, _DEGREE).toarray()
    spread = inverse.reshape(count, 3, count, 3)
    return SmoothCurve(
        rows @ control, np.einsum("na,aibj,nb->nij", rows, spread, rows), float(chi2.sf(square, freedom))
    )


def _length_mm(points_mm: FloatArray) -> float:
    """Length of a polyline whose points jitter: of about every tenth point."""
    coarse = points_mm[np.unique(np.linspace(0, len(points_mm) - 1, max(2, len(points_mm) // 10)).astype(int))]
    return float(np.linalg.norm(np.diff(coarse, axis=0), axis=1).sum())
