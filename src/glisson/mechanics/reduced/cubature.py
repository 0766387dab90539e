"""Hyper-reduction: few elements with weights that make the forces on the modes of all (ECSW)."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from glisson.core.arrays import FloatArray, IntArray

_BLOCK, _SHARE = 8, 0.1  # points that enter at once, or more as a share of those that have
_PASSES = 2000


@dataclass(frozen=True, eq=False)
class Cubature:
    """Numbers (m,) of the points that count, their factors (m,) > 0, and the share of the forces that they miss."""

    points: IntArray
    factors: FloatArray
    error: float


def choose_points(contributions: FloatArray, tolerance: float, most: int) -> Cubature:
    """Points whose weighted contributions (k, p) sum to those of all, up to `tolerance` of their norm.

    Non-negative least squares by active sets, stopped early, which leaves few points: Farhat, Avery, Chapman and
    Cortial 2014 (Int. J. Numer. Meth. Engng 98, 625). Factors that are not negative keep the energy bounded below.
    """
    goal = contributions.sum(axis=1)
    size = float(np.linalg.norm(goal))
    chosen = np.zeros(0, dtype=np.int64)
    factors = np.zeros(0)
    left = goal
    for _ in range(_PASSES):
        if float(np.linalg.norm(left)) <= tolerance * size or len(chosen) >= most:
            break
        gain = left @ contributions
        gain[chosen] = -np.inf
        entering = np.argsort(gain)[-max(_BLOCK, int(_SHARE * len(chosen))) :]
        chosen = np.concatenate([chosen, entering])
        factors = np.concatenate([factors, np.zeros(len(entering))])
        chosen, factors = _least_squares(contributions, goal, chosen, factors)
        left = goal - contributions[:, chosen] @ factors
    return Cubature(chosen, factors, float(np.linalg.norm(left)) / size)


def _least_squares(
    contributions: FloatArray, goal: FloatArray, chosen: IntArray, factors: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Least squares over the chosen points; those that would count negatively are let go one after the other."""
    while True:
        columns = contributions[:, chosen]
        products = columns.T @ columns
        products[np.diag_indices(len(chosen))] *= 1.0 + 1e-12
        lower = np.linalg.cholesky(products)
        half = solve_triangular(lower, columns.T @ goal, lower=True)
        wanted = solve_triangular(lower.T, half, lower=False)
        if wanted.min() > 0.0:
            return chosen, wanted
        falling = wanted <= 0.0
        ways = factors[falling] / np.maximum(factors[falling] - wanted[falling], 1e-300)
        factors = factors + float(ways.min()) * (wanted - factors)
        kept = ~(falling & (factors <= 1e-12 * max(float(factors.max()), 1e-300)))
        if kept.all():
            kept[np.flatnonzero(falling)[ways.argmin()]] = False
        chosen, factors = chosen[kept], factors[kept]
