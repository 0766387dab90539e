"""Sparse Cholesky by MKL's PARDISO, called directly so that the analysis is kept over Newton steps."""

import ctypes
import sys
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from glisson.core.arrays import FloatArray

_SYMMETRIC_POSITIVE_DEFINITE = 2
_ANALYSE, _FACTOR, _SOLVE, _RELEASE = 11, 22, 33, -1
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


class Pardiso:
    """Cholesky factor of a sparse matrix; a matrix that is not positive definite is told, not solved."""

    def __init__(self) -> None:
        library = pardiso_library()
        if library is None:
            raise RuntimeError("MKL is not installed.")
        self._call = library.pardiso
        self._handle = np.zeros(64, dtype=np.int64)
        self._settings = np.zeros(64, dtype=np.int32)
        self._settings[[0, 1, 9, 34]] = (1, 2, 13, 1)  # own settings, METIS ordering, pivot 1e-13, zero-based
        self._settings[23] = 1  # two-level factorisation, which scales to both cores
        self._pattern: tuple[int, int] | None = None
        self._matrix: csr_matrix | None = None

    def factor(self, upper: csr_matrix) -> bool:
        """Factor; the analysis is repeated only when the pattern's size changed."""
        pattern = (upper.shape[0], upper.nnz)
        if pattern != self._pattern:
            self.close()
            self._pattern = pattern
            self._matrix = upper
            self._run(_ANALYSE, np.zeros(1), np.zeros(1))
        self._matrix = upper
        error = self._run(_FACTOR, np.zeros(1), np.zeros(1))
        return error != _NOT_POSITIVE_DEFINITE

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution with the last factor."""
        right = np.ascontiguousarray(right, dtype=np.float64)
        solution = np.zeros_like(right)
        self._run(_SOLVE, right, solution)
        return solution

    def close(self) -> None:
        """Release PARDISO's memory."""
        if self._pattern is not None:
            self._run(_RELEASE, np.zeros(1), np.zeros(1))
            self._pattern = None

    def __del__(self) -> None:
        self.close()

    def _run(self, phase: int, right: FloatArray, solution: FloatArray) -> int:
        assert self._matrix is not None  # every caller sets it first
        matrix = self._matrix
        error = ctypes.c_int32(0)
        one = ctypes.byref(ctypes.c_int32(1))
        permutation = np.zeros(1, dtype=np.int32)
        self._call(
            _pointer(self._handle), one, one,
            ctypes.byref(ctypes.c_int32(_SYMMETRIC_POSITIVE_DEFINITE)),
            ctypes.byref(ctypes.c_int32(phase)),
            ctypes.byref(ctypes.c_int32(matrix.shape[0])),
            _pointer(matrix.data), _pointer(matrix.indptr), _pointer(matrix.indices), _pointer(permutation), one,
            _pointer(self._settings), ctypes.byref(ctypes.c_int32(0)),
            _pointer(right), _pointer(solution), ctypes.byref(error),
        )  # fmt: skip
        if error.value not in (0, _NOT_POSITIVE_DEFINITE):
            raise MemoryError(f"PARDISO ended with error {error.value} (−2 is too little memory) in phase {phase}.")
        return error.value


def _pointer(array: NDArray[Any]) -> ctypes.c_void_p:
    return array.ctypes.data_as(ctypes.c_void_p)
