"""Solves with a matrix that is not symmetric but close to one that a solver has at hand."""

from scipy.sparse.linalg import LinearOperator, gmres
from threadpoolctl import threadpool_limits

from glisson.core.arrays import FloatArray
from glisson.mechanics.linear_solvers import LinearSolver
from glisson.mechanics.pattern import Stiffness

_KRYLOV_VECTORS = 40


def solve_near_symmetric(matrix: Stiffness, solver: LinearSolver, right: FloatArray, accuracy: float) -> FloatArray:
    """The field (n, 3) whose product with `matrix` is `right` (n, 3) on the free unknowns; zero on the others.

    GMRES, preconditioned by the symmetric matrix's solver. An answer short of the accuracy (of the right-hand
    side's norm) is returned as it is: the caller judges it by the residual.
    """
    system = matrix.system
    shape = (len(system.free), len(system.free))
    with threadpool_limits(1):  # a BLAS with many threads would make those of the products wait
        found, _ = gmres(
            LinearOperator(shape, lambda values: system.restrict(matrix.product(system.extend(values))), dtype=float),
            system.restrict(right),
            M=LinearOperator(shape, lambda v: system.restrict(solver.precondition(system.extend(v))), dtype=float),
            rtol=accuracy,
            restart=_KRYLOV_VECTORS,
            maxiter=1,
        )
    return system.extend(found)
