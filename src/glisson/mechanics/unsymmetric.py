"""Solves with a matrix that is not symmetric but close to one whose factor is at hand."""

import numpy as np
from scipy.sparse import bsr_matrix
from scipy.sparse.linalg import LinearOperator, gmres

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.linear_solvers import Factorisation

_ACCURACY = 1e-3  # of the right-hand side: enough for Newton steps that gain three digits each
_KRYLOV_VECTORS = 40


def solve_near_symmetric(
    matrix: bsr_matrix, free: IntArray, factorisation: Factorisation, right: FloatArray
) -> FloatArray:
    """The field (n, 3) whose product with `matrix` is `right` (n, 3) on the free unknowns; zero on the others.

    GMRES, preconditioned by the symmetric factor, which lives on the free unknowns. An answer short of the
    accuracy is returned as it is: the caller judges it by the residual.
    """
    whole, shape = np.zeros(right.size), (len(free), len(free))

    def times(values: FloatArray) -> FloatArray:
        whole[free] = values
        result: FloatArray = (matrix @ whole)[free]
        return result

    field = np.zeros(right.size)
    field[free], _ = gmres(
        LinearOperator(shape, times, dtype=float),
        right.ravel()[free],
        M=LinearOperator(shape, factorisation.solve, dtype=float),
        rtol=_ACCURACY,
        restart=_KRYLOV_VECTORS,
        maxiter=1,
    )
    return field.reshape(right.shape)
