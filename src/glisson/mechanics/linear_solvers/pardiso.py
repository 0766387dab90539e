"""Sparse Cholesky by MKL's PARDISO, called directly so that the analysis is kept over Newton steps."""

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.pattern import FreeSystem, Stiffness

_SYMMETRIC_POSITIVE_DEFINITE = 2
_ANALYSE, _FACTOR, _SOLVE, _FORWARD, _BACKWARD, _RELEASE = 11, 22, 33, 331, 333, -1
_NOT_POSITIVE_DEFINITE = -4


@cache
def pardiso_library() -> ctypes.CDLL | None:
    """MKL's single dynamic library, or None where it is not installed in this environment."""
    for folder in (Path(sys.prefix) / "lib", Path(sys.prefix) / "Library" / "bin"):
        for path in sorted(folder.glob("*mkl_rt*"), reverse=True):
            try:
                return ctypes.CDLL(str(path))
            except OSError:
                continue
    return None


class _Handle:
    """One matrix in PARDISO's memory; its analysis is kept until it is closed.

    Args:
        kept: (n,) 1 for the unknowns onto which the matrix is condensed; None for none.
        precision: of the matrix and of right-hand sides.
    """

    def __init__(self, kept: NDArray[np.int32] | None = None, precision: type[np.floating[Any]] = np.float64) -> None:
        library = pardiso_library()
        if library is None:
            raise RuntimeError("MKL is not installed.")
        self._call = library.pardiso
        self._memory = np.zeros(64, dtype=np.int64)
        self._settings = np.zeros(64, dtype=np.int32)
        self._settings[[0, 1, 9, 34]] = (1, 2, 13, 1)  # own settings, METIS ordering, pivot 1e-13, zero-based
        self._settings[23] = 1  # two-level factorisation, which scales to both cores
        self._settings[27] = int(precision is np.float32)
        if kept is not None:
            self._settings[35] = 2  # the Schur complement comes with the factor, whose halves can be applied alone
        self._permutation = np.zeros(1, dtype=np.int32) if kept is None else kept
        self._matrix: csr_matrix | None = None

    def factor(self, upper: csr_matrix, out: NDArray[Any]) -> bool:
        """Factor; `out` takes the Schur complement. False where a pivot is not positive."""
        analysed, self._matrix = self._matrix is not None, upper
        if not analysed:
            self.run(_ANALYSE, np.zeros(1), out)
        return self.run(_FACTOR, np.zeros(1), out) != _NOT_POSITIVE_DEFINITE

    def run(self, phase: int, right: NDArray[Any], solution: NDArray[Any]) -> int:
        """One phase with the matrix at hand; PARDISO's error number where it only means an indefinite matrix."""
        assert self._matrix is not None  # every caller factors first
        matrix = self._matrix
        error = ctypes.c_int32(0)
        one = ctypes.byref(ctypes.c_int32(1))
        self._call(
            _pointer(self._memory), one, one,
            ctypes.byref(ctypes.c_int32(_SYMMETRIC_POSITIVE_DEFINITE)),
            ctypes.byref(ctypes.c_int32(phase)),
            ctypes.byref(ctypes.c_int32(matrix.shape[0])),
            _pointer(matrix.data), _pointer(matrix.indptr), _pointer(matrix.indices), _pointer(self._permutation), one,
            _pointer(self._settings), ctypes.byref(ctypes.c_int32(0)),
            _pointer(right), _pointer(solution), ctypes.byref(error),
        )  # fmt: skip
        if error.value not in (0, _NOT_POSITIVE_DEFINITE):
            raise MemoryError(f"PARDISO ended with error {error.value} (−2 is too little memory) in phase {phase}.")
        return error.value

    def close(self) -> None:
        """Release PARDISO's memory."""
        if self._matrix is not None:
            self.run(_RELEASE, np.zeros(1), np.zeros(1))
            self._matrix = None

    def __del__(self) -> None:
        if not sys.is_finalizing():
            self.close()


class Pardiso:
    """Cholesky factor of a sparse matrix; a matrix that is not positive definite is told, not solved."""

    def __init__(self) -> None:
        self._handle = _Handle()
        self._system: FreeSystem | None = None

    def factor(self, matrix: Stiffness) -> bool:
        """Factor; the analysis is repeated only for another pattern."""
        if self._system is not matrix.system:
            self._handle.close()
        self._system = matrix.system
        return self._handle.factor(matrix.upper, np.zeros(1))

    def solve(self, right: FloatArray, accuracy: float) -> FloatArray:
        """Solution (n, 3) with the last factor, as accurate as can be."""
        assert self._system is not None  # every caller factors first
        free = self._system.restrict(right)
        solution = np.zeros_like(free)
        self._handle.run(_SOLVE, free, solution)
        return self._system.extend(solution)

    def precondition(self, right: FloatArray) -> FloatArray:
        """The solution (n, 3)."""
        return self.solve(right, 0.0)

    def close(self) -> None:
        """Release PARDISO's memory."""
        self._handle.close()


class PardisoCondensation:
    """Schur complement of a sparse matrix onto a few unknowns, for the price of a Cholesky factor.

    In single precision, which takes half the time: condensed steps are guesses that the exact stiffness corrects.
    """

    def __init__(self, size: int, kept: IntArray) -> None:
        marks = np.zeros(size, dtype=np.int32)
        marks[kept] = 1
        self._kept, self._handle = kept, _Handle(marks, np.float32)
        self._forward = np.zeros(size, dtype=np.float32)

    def factor(self, upper: csr_matrix) -> FloatArray | None:
        """The Schur complement (k, k); None where the matrix of the other unknowns is not positive definite."""
        count = len(self._kept)
        out = np.zeros(max(count**2, upper.shape[0]), dtype=np.float32)
        # PARDISO goes on to factor the complement, which need not be definite: springs make it so.
        stiffened = upper.astype(np.float32)
        diagonal = upper.indptr[self._kept]  # the first entries of their rows
        springs = np.float32(10.0 * np.abs(upper.data).max())
        stiffened.data[diagonal] += springs
        if not self._handle.factor(stiffened, out):
            return None
        return out[: count**2].reshape(count, count).astype(np.float64) - float(springs) * np.eye(count)

    def reduce(self, right: FloatArray) -> FloatArray:
        """The load (k,) that the kept unknowns feel of a right-hand side (n,)."""
        self._handle.run(_FORWARD, right.astype(np.float32), self._forward)
        return self._forward[self._kept].astype(np.float64)

    def expand(self, kept: FloatArray) -> FloatArray:
        """The solution (n,) for the right-hand side of the last `reduce`, the kept unknowns (k,) given."""
        values, solution = self._forward.copy(), np.zeros_like(self._forward)
        values[self._kept] = kept
        self._handle.run(_BACKWARD, values, solution)
        return solution.astype(np.float64)

    def close(self) -> None:
        """Release PARDISO's memory."""
        self._handle.close()


def _pointer(array: NDArray[Any]) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)
