"""Multigrid by smoothed aggregation that reproduces rigid motions (Vaněk, Mandel, Brezina 1996, Computing 56).

Nodes are gathered in groups, and each group moves as a rigid body on the next coarser level, smoothed by one step of
Jacobi's method; quadratic elements have linear ones as their first coarser level. Hierarchies are kept over Newton
steps: what sweeps need follows the matrix each time, the coarser levels only when `build` is called.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pyamg.aggregation.aggregate import standard_aggregation
from pyamg.aggregation.tentative import fit_candidates
from scipy.sparse import bsr_matrix, csr_matrix
from threadpoolctl import threadpool_limits

from glisson.core.arrays import FloatArray
from glisson.mechanics.block_rows import BlockRows, times
from glisson.mechanics.pattern import Stiffness
from glisson.mechanics.symmetric_rows import HalfPattern, SymmetricRows

_COARSEST = 700  # unknowns, for which a dense inverse costs nothing
_POWER_STEPS = 12
_SAFETY = 1.05  # the power method comes from below
_OVERSHOOT = 4.0 / 3.0  # of the prolongation's Jacobi step, over the largest eigenvalue
_RANK = 1e-10  # of the largest eigenvalue; below it a direction of the coarsest level is empty

Single = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class _Level:
    """Matrix, inverses of its diagonal blocks (n, 3, 3), and the way to the next coarser level and back."""

    rows: SymmetricRows
    inverses: Single
    down: BlockRows
    up: BlockRows


class Multigrid:
    """One symmetric cycle in single precision as a preconditioner."""

    price = 30

    def __init__(self) -> None:
        self._levels: list[_Level] = []

    def build(self, matrix: Stiffness) -> bool:
        """A new hierarchy."""
        modes = _rigid_modes(matrix)
        fine = matrix.pattern.matrix(matrix.blocks)
        rows, inverses = _first_level(matrix)
        self._levels = []
        while True:
            prolongation, modes = _coarsen(fine, inverses, modes)
            restriction = prolongation.T.tobsr()
            ways = BlockRows.of(restriction, np.float32), BlockRows.of(prolongation, np.float32)
            self._levels.append(_Level(rows, inverses, *ways))
            size = modes.shape[1]
            fine = times(restriction, times(fine, prolongation)).tobsr((size, size))
            fine.sort_indices()
            if fine.shape[0] <= _COARSEST:
                break
            rows = _symmetric_rows(fine)
            inverses = rows.inverses(np.zeros((fine.shape[0] // 3, 3), dtype=np.bool_))
        self._coarsest = _inverse(fine.toarray())
        return True

    def renew(self, matrix: Stiffness) -> None:
        """Let the sweeps on the finest level follow another matrix of the same pattern."""
        rows, inverses = _first_level(matrix)
        first = self._levels[0]
        self._levels[0] = _Level(rows, inverses, first.down, first.up)

    def apply(self, right: FloatArray) -> FloatArray:
        """The cycle's answer (n, 3) to a right-hand side (n, 3)."""
        answer: FloatArray = self._cycle(0, right.astype(np.float32)).astype(np.float64)
        return answer

    def close(self) -> None:
        """Give the levels' memory back."""
        self._levels = []

    def _cycle(self, number: int, right: Single) -> Single:
        if number == len(self._levels):
            answer: Single = (self._coarsest @ right.ravel()).reshape(-1, 3)
            return answer
        level = self._levels[number]
        solution: Single
        solution, left = level.rows.sweep_from_zero(level.inverses, right)
        solution += level.up.product(self._cycle(number + 1, level.down.product(left)))
        level.rows.sweep_back(level.inverses, right, solution)
        return solution


def _first_level(matrix: Stiffness) -> tuple[SymmetricRows, Single]:
    """The matrix in single precision, and its diagonal blocks' inverses, which leave held unknowns at rest."""
    rows = SymmetricRows(matrix.pattern.half, matrix.blocks, np.float32)
    return rows, rows.inverses(matrix.held)


def _symmetric_rows(matrix: bsr_matrix) -> SymmetricRows:
    cut = BlockRows.of(matrix, np.float32)
    return SymmetricRows(HalfPattern(cut.indptr, cut.indices), cut.blocks, np.float32)


def _rigid_modes(matrix: Stiffness) -> FloatArray:
    """Translations and turns of the nodes as (3 n, 6); zero where held."""
    arms = matrix.positions - matrix.positions.mean(axis=0)
    modes = np.zeros((len(arms), 3, 6))
    modes[:, range(3), range(3)] = 1.0
    for axis in range(3):
        modes[:, :, 3 + axis] = np.cross(np.eye(3)[axis], arms)
    modes[matrix.held] = 0.0
    return modes.reshape(-1, 6)


def _coarsen(matrix: bsr_matrix, inverses: Single, modes: FloatArray) -> tuple[bsr_matrix, FloatArray]:
    """Smoothed prolongation from groups of nodes, and the modes on the coarser level."""
    size = matrix.blocksize[0]
    strengths = np.abs(matrix.data).max(axis=(1, 2)).astype(np.float64)
    graph = csr_matrix((strengths, matrix.indices.copy(), matrix.indptr.copy()), (len(matrix.indptr) - 1,) * 2)
    graph.eliminate_zeros()
    groups, _ = standard_aggregation(graph)
    tentative, coarse_modes = fit_candidates(groups, modes)
    scaling = bsr_matrix((inverses.astype(np.float64), np.arange(len(inverses)), np.arange(len(inverses) + 1)))
    largest = _largest_eigenvalue(scaling, matrix)
    correction = scaling @ times(matrix, tentative).tobsr((3, modes.shape[1]))
    prolongation = tentative - (_OVERSHOOT / largest) * correction
    return prolongation.tobsr((size, modes.shape[1])), coarse_modes


def _largest_eigenvalue(scaling: bsr_matrix, matrix: bsr_matrix) -> float:
    vector: NDArray[Any] = np.random.default_rng(0).normal(size=matrix.shape[0])
    largest = 1.0
    for _ in range(_POWER_STEPS):
        vector = scaling @ (matrix @ vector)
        largest = float(np.linalg.norm(vector))
        vector /= largest
    return _SAFETY * largest


def _inverse(matrix: FloatArray) -> Single:
    """Inverse of the coarsest level's matrix; directions that no node moves along stay at rest."""
    with threadpool_limits(1):  # so small a matrix is not worth the threads' waiting for each other
        values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    kept = values > _RANK * values[-1]
    inverse: Single = ((vectors[:, kept] / values[kept]) @ vectors[:, kept].T).astype(np.float32)
    return inverse
