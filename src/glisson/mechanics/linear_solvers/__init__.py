"""Factorisations of the symmetric stiffness; the best one that is installed is used."""

from typing import Protocol

from scipy.sparse import csr_matrix

from glisson.core.arrays import FloatArray
from glisson.mechanics.linear_solvers.pardiso import Pardiso, pardiso_library
from glisson.mechanics.linear_solvers.superlu import SuperLU


class Factorisation(Protocol):
    """Solves with symmetric positive definite matrices that all share one sparsity pattern."""

    def factor(self, upper: csr_matrix) -> bool:
        """Factor the matrix whose upper triangle is given; False where it is not positive definite."""

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution (n,) with the last factor."""

    def close(self) -> None:
        """Give the factor's memory back."""


def make_factorisation() -> Factorisation:
    """MKL's PARDISO where MKL is installed, else SciPy's SuperLU (slower, and more memory)."""
    return Pardiso() if pardiso_library() is not None else SuperLU()
