"""Sums over nodal fields, in one thread: a BLAS with many would make them wait longer than they compute."""

import numpy as np
from numba import njit

from glisson.core.arrays import FloatArray


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def dot(first: FloatArray, second: FloatArray) -> float:
    """Σ first · second of fields (n, 3)."""
    total = 0.0
    for n in range(len(first)):
        for i in range(3):
            total += first[n, i] * second[n, i]
    return total


@njit(cache=True, nogil=True)
def add_scaled(target: FloatArray, factor: float, field: FloatArray) -> None:
    """Add factor · field to target (n, 3)."""
    for n in range(len(target)):
        for i in range(3):
            target[n, i] += factor * field[n, i]


@njit(cache=True, nogil=True)
def scale_and_add(target: FloatArray, factor: float, field: FloatArray) -> None:
    """Replace target (n, 3) by factor · target + field."""
    for n in range(len(target)):
        for i in range(3):
            target[n, i] = factor * target[n, i] + field[n, i]


def norm(field: FloatArray) -> float:
    """√Σ field² of a field (n, 3)."""
    return float(np.sqrt(dot(field, field)))
