"""Products and sweeps with half of a symmetric matrix are those of the whole matrix in SciPy and NumPy."""

import numpy as np
import pytest
from scipy.sparse import bsr_matrix

from glisson.mechanics import block_rows
from glisson.mechanics.symmetric_rows import HalfPattern, SymmetricRows

_REACH = 8


def _matrix(count: int, banded: bool) -> bsr_matrix:
    """A positive definite one of 3 × 3 blocks, numbered by place or not; one row has no blocks."""
    rng = np.random.default_rng(count)
    graph = rng.random((count, count)) < 0.3
    if banded:
        graph &= np.abs(np.subtract.outer(np.arange(count), np.arange(count))) <= _REACH
    graph |= graph.T | np.eye(count, dtype=bool)
    blocks = rng.normal(size=(3 * count, 3 * count)) * np.kron(graph, np.ones((3, 3)))
    blocks += blocks.T + 200.0 * np.eye(3 * count)
    blocks[-3:] = blocks[:, -3:] = 0.0
    return _by_blocks(blocks)


def _by_blocks(matrix: np.ndarray) -> bsr_matrix:
    found = bsr_matrix(matrix, blocksize=(3, 3))
    found.sort_indices()
    return found


@pytest.fixture(params=[1, 2, 5])
def cores(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> int:
    """A machine with so many cores."""
    monkeypatch.setattr(block_rows, "_CORES", request.param)
    monkeypatch.setattr(block_rows, "_FEWEST", 1)
    return int(request.param)


@pytest.mark.parametrize("banded", [True, False])
def test_product(cores: int, banded: bool) -> None:
    """With either half, whatever the number of spans."""
    matrix = _matrix(120, banded)
    half = HalfPattern(matrix.indptr, matrix.indices)
    assert len(half.free) == (cores if banded else 1)
    values = np.random.default_rng(1).normal(size=(120, 3))
    found = SymmetricRows(half, matrix.data, np.float64).product(values)
    np.testing.assert_allclose(found.ravel(), matrix @ values.ravel(), atol=1e-11)


def test_product_of_two_matrices(cores: int) -> None:
    """By rows on several cores it is SciPy's own, though blocks of the second are of another size."""
    matrix = _matrix(60, banded=True)
    other = bsr_matrix(np.random.default_rng(2).normal(size=(180, 48)), blocksize=(3, 6))
    found = block_rows.times(matrix, other)
    assert (found.shape, found.blocksize) == ((180, 48), (3, 6))
    np.testing.assert_allclose(found.toarray(), (matrix @ other).toarray(), atol=1e-11)


@pytest.mark.parametrize("banded", [True, False])
def test_sweeps_are_those_of_one_core(cores: int, banded: bool) -> None:
    """Block Gauss–Seidel in the order of the pattern, with triangles that SciPy and NumPy make of the matrix."""
    matrix = _matrix(120, banded)
    half = HalfPattern(matrix.indptr, matrix.indices)
    held = np.zeros((120, 3), dtype=bool)
    held[::7, 1] = held[::11] = held[-1] = True
    rows = SymmetricRows(half, matrix.data, np.float64)
    inverses = rows.inverses(held)
    nodes = np.concatenate([np.arange(*span) for span in (*half.free, *half.apart)])
    order = (3 * nodes[:, None] + np.arange(3)).ravel()
    order = order[~held.ravel()[order]]
    dense = matrix.toarray()[np.ix_(order, order)]
    numbers = np.repeat(nodes, 3)[~held[nodes].ravel()]
    lower = dense * _before_or_in_block(numbers, nodes)
    right = np.random.default_rng(2).normal(size=(120, 3))
    solution, left = rows.sweep_from_zero(inverses, right)
    expected = np.linalg.solve(lower, right.ravel()[order])
    np.testing.assert_allclose(solution.ravel()[order], expected, atol=1e-12)
    assert not solution[held].any()
    np.testing.assert_allclose(left.ravel()[order], right.ravel()[order] - dense @ expected, atol=1e-11)
    start = np.where(held, 0.0, np.random.default_rng(3).normal(size=(120, 3)))
    moved = start.copy()
    rows.sweep_back(inverses, right, moved)
    before = start.ravel()[order]
    expected = before + np.linalg.solve(lower.T, right.ravel()[order] - dense @ before)
    np.testing.assert_allclose(moved.ravel()[order], expected, atol=1e-11)
    assert not moved[held].any()


def _before_or_in_block(numbers: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Which columns' nodes come before the row's, or are the same."""
    rank = np.zeros(len(nodes), dtype=int)
    rank[nodes] = np.arange(len(nodes))
    return rank[numbers][None, :] <= rank[numbers][:, None]


def test_single_precision() -> None:
    """The same to seven digits."""
    matrix = _matrix(40, banded=True)
    values = np.random.default_rng(5).normal(size=(40, 3)).astype(np.float32)
    rows = SymmetricRows(HalfPattern(matrix.indptr, matrix.indices), matrix.data, np.float32)
    np.testing.assert_allclose(rows.product(values).ravel(), matrix @ values.ravel(), rtol=1e-6, atol=1e-3)
