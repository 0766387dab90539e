"""Sparse LU by SuperLU (in SciPy): always there, used where MKL is not installed."""

import numpy as np
from scipy.sparse import csr_matrix, triu
from scipy.sparse.linalg import splu

from glisson.core.arrays import FloatArray


class SuperLU:
    """LU without row exchanges, so that the signs of U's diagonal tell whether the matrix is definite."""

    def factor(self, upper: csr_matrix) -> bool:
        """Factor; False where a pivot is not positive."""
        whole = (upper + triu(upper, 1).T).tocsc()
        options = {"SymmetricMode": True}
        try:
            self._factor = splu(whole, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        except RuntimeError:  # SuperLU's word for an exactly singular matrix
            return False
        return bool(np.all(self._factor.U.diagonal() > 0.0))

    def solve(self, right: FloatArray) -> FloatArray:
        """Solution with the last factor."""
        solution: FloatArray = self._factor.solve(right)
        return solution

    def close(self) -> None:
        """SciPy frees the factor with the object."""
