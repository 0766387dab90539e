"""Solves with a matrix that is not symmetric but close to one that a solver has at hand."""

from scipy.sparse import bsr_matrix
from scipy.sparse.linalg import LinearOperator, gmres

from glisson.core.arrays import FloatArray
from glisson.mechanics.linear_solvers import LinearSolver
from glisson.mechanics.pattern import FreeSystem

_ACCURACY = 1e-3  # of the right-hand side: enough for Newton steps that gain three digits each
_KRYLOV_VECTORS = 40


def solve_near_symmetric(matrix: bsr_matrix, system: FreeSystem, solver: LinearSolver, right: FloatArray) -> FloatArray:
    """The field (n, 3) whose product with `matrix` is `right` (n, 3) on the free unknowns; zero on the others.

    GMRES, preconditioned by the symmetric matrix's solver. An answer short of the accuracy is returned as it is:
    the caller judges it by the residual.
    """
    shape = (len(system.free), len(system.free))
    found, _ = gmres(
        LinearOperator(shape, lambda values: system.restrict(matrix @ system.extend(values).ravel()), dtype=float),
        system.restrict(right),
        M=LinearOperator(shape, lambda v: system.restrict(solver.precondition(system.extend(v))), dtype=float),
        rtol=_ACCURACY,
        restart=_KRYLOV_VECTORS,
        maxiter=1,
    )
    return system.extend(found)
