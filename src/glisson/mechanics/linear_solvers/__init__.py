"""Solvers for the symmetric stiffness; which one is used depends on its size and on what is installed."""

from typing import Protocol

from scipy.sparse import csr_matrix

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.linear_solvers.conjugate_gradients import ConjugateGradients
from glisson.mechanics.linear_solvers.multigrid import Multigrid
from glisson.mechanics.linear_solvers.nothing_condensed import NothingCondensed
from glisson.mechanics.linear_solvers.pardiso import Pardiso, PardisoCondensation, pardiso_library
from glisson.mechanics.linear_solvers.superlu import SuperLU, SuperLUCondensation
from glisson.mechanics.pattern import Stiffness


class LinearSolver(Protocol):
    """Solves with symmetric positive definite matrices that all share one sparsity pattern."""

    def factor(self, matrix: Stiffness) -> bool:
        """Take a matrix; False where it is known not to be positive definite."""

    def solve(self, right: FloatArray, accuracy: float) -> FloatArray | None:
        """Field (n, 3) that is zero where held, and whose product is `right` (n, 3) up to `accuracy` of its norm.

        None where the matrix turned out not to be positive definite.
        """

    def precondition(self, right: FloatArray) -> FloatArray:
        """A rough solution (n, 3), linear and symmetric in the right-hand side (n, 3)."""

    def close(self) -> None:
        """Give the memory back."""


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


def make_direct_solver() -> LinearSolver:
    """MKL's PARDISO where MKL is installed, else SciPy's SuperLU (slower, and more memory)."""
    return Pardiso() if pardiso_library() is not None else SuperLU()


def make_iterative_solver() -> LinearSolver:
    """Conjugate gradients with multigrid."""
    return ConjugateGradients(Multigrid())


def make_condensation(size: int, kept: IntArray) -> Condensation:
    """Condenses matrices of `size` unknowns onto those of the ascending numbers `kept` (k,)."""
    if len(kept) == size:
        return NothingCondensed()
    return PardisoCondensation(size, kept) if pardiso_library() is not None else SuperLUCondensation(size, kept)
