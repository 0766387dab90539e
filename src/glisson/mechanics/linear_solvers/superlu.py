"""Sparse LU by SuperLU (in SciPy): always there, used where MKL is not installed."""

from typing import Any

import numpy as np
from scipy.sparse import csr_matrix, triu
from scipy.sparse.linalg import splu

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.pattern import Stiffness

_COLUMNS = 64  # solved for at a time


def _lu(upper: csr_matrix) -> Any | None:
    """LU without row exchanges, so that the signs of U's diagonal tell whether the matrix is definite; None if not."""
    whole = (upper + triu(upper, 1).T).tocsc()
    options = {"SymmetricMode": True}
    try:
        factor = splu(whole, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
    except RuntimeError:  # SuperLU's word for an exactly singular matrix
        return None
    return factor if np.all(factor.U.diagonal() > 0.0) else None


class SuperLU:
    """LU of a sparse matrix; a matrix that is not positive definite is told, not solved."""

    def factor(self, matrix: Stiffness) -> bool:
        """Factor; False where a pivot is not positive."""
        self._system, self._factor = matrix.system, _lu(matrix.upper)
        return self._factor is not None

    def solve(self, right: FloatArray, accuracy: float) -> FloatArray:
        """Solution (n, 3) with the last factor, as accurate as can be."""
        assert self._factor is not None  # callers ask `factor` first
        return self._system.extend(self._factor.solve(self._system.restrict(right)))

    def precondition(self, right: FloatArray) -> FloatArray:
        """The solution (n, 3)."""
        return self.solve(right, 0.0)

    def close(self) -> None:
        """SciPy frees the factor with the object."""


class SuperLUCondensation:
    """Schur complement onto a few unknowns, column by column."""

    def __init__(self, size: int, kept: IntArray) -> None:
        self._kept, self._inner = kept, np.setdiff1d(np.arange(size), kept)

    def factor(self, upper: csr_matrix) -> FloatArray | None:
        """The Schur complement (k, k); None where the matrix of the other unknowns is not positive definite."""
        whole = (upper + triu(upper, 1).T).tocsr()
        factor = _lu(triu(whole[self._inner][:, self._inner]).tocsr())
        if factor is None:
            return None
        self._lu = factor
        self._coupling = whole[self._inner][:, self._kept]
        schur: FloatArray = whole[self._kept][:, self._kept].toarray()
        for first in range(0, len(self._kept), _COLUMNS):
            columns = slice(first, first + _COLUMNS)
            schur[:, columns] -= self._coupling.T @ self._lu.solve(self._coupling[:, columns].toarray())
        return schur

    def reduce(self, right: FloatArray) -> FloatArray:
        """The load (k,) that the kept unknowns feel of a right-hand side (n,)."""
        self._alone = self._lu.solve(right[self._inner])
        reduced: FloatArray = right[self._kept] - self._coupling.T @ self._alone
        return reduced

    def expand(self, kept: FloatArray) -> FloatArray:
        """The solution (n,) for the right-hand side of the last `reduce`, the kept unknowns (k,) given."""
        solution = np.zeros(len(self._kept) + len(self._inner))
        solution[self._kept] = kept
        solution[self._inner] = self._alone - self._lu.solve(self._coupling @ kept)
        return solution

    def close(self) -> None:
        """SciPy frees the factor with the object."""
