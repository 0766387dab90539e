"""Factorisations of the symmetric stiffness; the best one that is installed is used."""

from typing import Protocol

from scipy.sparse import csr_matrix

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.linear_solvers.pardiso import Pardiso, PardisoCondensation, pardiso_library
from glisson.mechanics.linear_solvers.superlu import SuperLU, SuperLUCondensation


class Factorisation(Protocol):
    """Solves with symmetric positive definite matrices that all share one sparsity pattern."""

    def factor(self, upper: csr_matrix) -> bool:
        """Factor the matrix whose upper triangle is given; False where it is not positive definite."""

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution (n,) with the last factor."""

    def close(self) -> None:
        """Give the factor's memory back."""


class Condensation(Protocol):
    """Condenses symmetric matrices that share one sparsity pattern onto a few of their unknowns."""

    def factor(self, upper: csr_matrix) -> FloatArray | None:
        """The Schur complement (k, k); None where the matrix of the other unknowns is not positive definite."""

    def reduce(self, right: FloatArray) -> FloatArray:
        """The load (k,) that the kept unknowns feel of a right-hand side (n,)."""

    def expand(self, kept: FloatArray) -> FloatArray:
        """The solution (n,) for the right-hand side of the last `reduce`, the kept unknowns (k,) given."""

    def close(self) -> None:
        """Give the factor's memory back."""


def make_factorisation() -> Factorisation:
    """MKL's PARDISO where MKL is installed, else SciPy's SuperLU (slower, and more memory)."""
    return Pardiso() if pardiso_library() is not None else SuperLU()


def make_condensation(size: int, kept: IntArray) -> Condensation:
    """Condenses matrices of `size` unknowns onto those of the ascending numbers `kept` (k,)."""
    return PardisoCondensation(size, kept) if pardiso_library() is not None else SuperLUCondensation(size, kept)
