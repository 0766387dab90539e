"""Condensation against dense algebra: A = K⁻¹ restricted to the kept unknowns is the Schur complement's inverse."""

import numpy as np
import pytest
from scipy.sparse import csr_matrix, triu

from glisson.mechanics.linear_solvers.pardiso import PardisoCondensation, pardiso_library
from glisson.mechanics.linear_solvers.superlu import SuperLUCondensation

KEPT = np.array([2, 3, 7, 30, 39])
NO_MKL = pytest.mark.skipif(pardiso_library() is None, reason="MKL is not installed")
METHODS = [(SuperLUCondensation, np.float64), pytest.param(PardisoCondensation, np.float32, marks=NO_MKL)]
"""With the precision in which they work."""


def _matrix(size: int = 40) -> np.ndarray:
    rng = np.random.default_rng(4)
    dense = np.where(rng.uniform(size=(size, size)) < 0.15, rng.normal(size=(size, size)), 0.0)
    return dense @ dense.T + 0.5 * np.eye(size)


def _upper(matrix: np.ndarray) -> csr_matrix:
    upper = triu(csr_matrix(matrix)).tocsr()
    upper.sort_indices()
    upper.indices, upper.indptr = upper.indices.astype(np.int32), upper.indptr.astype(np.int32)
    return upper


def _accuracy(matrix: np.ndarray, precision: type) -> float:
    """Rounding after springs of ten times the largest entry, and ten operations."""
    return 100.0 * float(np.finfo(precision).eps) * np.abs(matrix).max()


@pytest.mark.parametrize(("method", "precision"), METHODS)
def test_the_condensed_system_gives_the_whole_solution(method, precision) -> None:
    matrix, right = _matrix(), np.random.default_rng(5).normal(size=40)
    condensation, accuracy = method(40, KEPT), _accuracy(matrix, precision)
    schur = condensation.factor(_upper(matrix))
    np.testing.assert_allclose(np.linalg.inv(schur), np.linalg.inv(matrix)[np.ix_(KEPT, KEPT)], 0.0, accuracy)
    kept = np.linalg.solve(schur, condensation.reduce(right))
    np.testing.assert_allclose(condensation.expand(kept), np.linalg.solve(matrix, right), 0.0, accuracy)
    condensation.close()


@pytest.mark.parametrize(("method", "precision"), METHODS)
def test_only_the_unknowns_that_go_must_be_definite(method, precision) -> None:
    matrix = _matrix()
    matrix[KEPT[0], KEPT[0]] -= 1e3  # what remains is indefinite, which is the caller's affair
    gone = np.setdiff1d(np.arange(40), KEPT)
    inner, coupling = matrix[np.ix_(gone, gone)], matrix[np.ix_(gone, KEPT)]
    expected = matrix[np.ix_(KEPT, KEPT)] - coupling.T @ np.linalg.solve(inner, coupling)
    condensation, accuracy = method(40, KEPT), _accuracy(matrix, precision)
    np.testing.assert_allclose(condensation.factor(_upper(matrix)), expected, 0.0, accuracy)
    matrix[gone[0], gone[0]] -= 1e3
    assert condensation.factor(_upper(matrix)) is None
    condensation.close()
