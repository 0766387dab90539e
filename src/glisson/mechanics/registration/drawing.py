"""Curves that were drawn a little off in the scan: each as a whole, by a shift that is found with all else.

However many of its points are seen, they tell where a curve is no better than it was drawn; how it runs they do tell.
"""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.registration.rows import Rows

DRAWN_MM = 1.5
"""Standard deviation of a curve's shift along each axis."""

SHIFT_PRECISION = 1.0 / DRAWN_MM**2
"""Of each coordinate of a shift, per mm²."""


def shift_cost(shifts_mm: FloatArray) -> float:
    """What shifts (q, 3) cost."""
    return 0.5 * SHIFT_PRECISION * float((shifts_mm**2).sum())


def with_shifts(jacobian: FloatArray, rows: Rows, count: int) -> FloatArray:
    """A derivative (r, k) of the whitened points, with that by `count` curves' shifts (r, k + 3 count) beside it."""
    beside = np.zeros((len(jacobian), count, 3))
    shifted = np.flatnonzero(rows.curve >= 0)
    beside[shifted, rows.curve[shifted]] = (rows.directions / rows.sigma_mm[:, None])[shifted]
    joined: FloatArray = np.concatenate([jacobian, beside.reshape(len(jacobian), -1)], axis=1)
    return joined


def with_shift_prior(pull: FloatArray, prior: FloatArray, shifts_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gradient (k,) and Hessian (k, k) of what all else costs, with those of the shifts (q, 3) behind."""
    size = len(pull) + shifts_mm.size
    hessian = np.zeros((size, size))
    hessian[: len(pull), : len(pull)] = prior
    hessian[len(pull) :, len(pull) :] = SHIFT_PRECISION * np.eye(shifts_mm.size)
    return np.concatenate([pull, SHIFT_PRECISION * shifts_mm.ravel()]), hessian


def marginal(hessian: FloatArray, size: int) -> FloatArray:
    """What a Hessian says of its first `size` unknowns, whatever the others are (Schur complement)."""
    own, between, rest = hessian[:size, :size], hessian[:size, size:], hessian[size:, size:]
    complement: FloatArray = own - between @ np.linalg.solve(rest, between.T)
    return complement
