"""Modes of displacement from full solutions: proper orthogonal decomposition (POD)."""

import numpy as np

from glisson.core.arrays import FloatArray


def modes(displacements: FloatArray, count: int) -> FloatArray:
    """The `count` orthonormal fields (n, 3, count) that leave the least of displacements (s, n, 3), in squares.

    Sirovich 1987; by the small matrix of the snapshots' products. There are fewer where the snapshots span fewer.
    """
    flat = displacements.reshape(len(displacements), -1)
    values, vectors = np.linalg.eigh(flat @ flat.T)
    values, vectors = values[::-1], vectors[:, ::-1]
    kept = min(count, int((values > _NOTHING * values[0]).sum()))
    fields = (vectors[:, :kept].T @ flat).T
    # Squares lose half of the digits: what is nearly nothing is made orthogonal once more.
    basis, _ = np.linalg.qr(fields / np.sqrt(values[:kept]))
    return np.ascontiguousarray(basis).reshape(*displacements.shape[1:], kept)


_NOTHING = 1e-14
