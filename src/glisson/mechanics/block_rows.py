"""Products and Gauss–Seidel sweeps with symmetric matrices of 3 × 3 blocks, on all cores.

Rows are cut into one span for each core. Rows at the start of a span that couple to the one before are set apart:
spans without them do not see each other, so that cores can sweep them at the same time, and the rows set apart come
after them. The outcome is that of one core that takes the rows in this order.
"""

import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

Blocks = NDArray[np.floating[Any]]
"""Of either precision: preconditioners work in single precision, which halves what has to be read."""

Index = NDArray[np.integer[Any]]
Span = tuple[int, int]

_CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
_FAST = {"contract", "reassoc"}
_threads = ThreadPoolExecutor(_CORES, thread_name_prefix="glisson-blocks")


class BlockRows:
    """A matrix of 3 × 3 blocks by rows; columns ascend in each row.

    Args:
        indptr: (n + 1,) first block of each row.
        indices: (b,) block columns.
        blocks: (b, 3, 3).
    """

    def __init__(self, indptr: Index, indices: Index, blocks: Blocks) -> None:
        self.indptr, self.indices, self.blocks = indptr, indices, blocks
        cuts = np.searchsorted(indptr, np.linspace(0, len(indices), _CORES + 1))
        cuts[0], cuts[-1] = 0, len(indptr) - 1
        self._spans = [(int(a), int(b)) for a, b in itertools.pairwise(cuts) if b > a]

    @classmethod
    def of(cls, matrix: bsr_matrix, precision: type[np.floating[Any]]) -> "BlockRows":
        """A sparse matrix, cut into 3 × 3 blocks."""
        cut = matrix.tobsr((3, 3))
        cut.sort_indices()
        return cls(cut.indptr, cut.indices, cut.data.astype(precision))

    def product(self, values: Blocks) -> Blocks:
        """The product (n, 3) with values (m, 3)."""
        result = np.zeros((len(self.indptr) - 1, 3), dtype=values.dtype)
        _each(self._spans, lambda a, b: _product(self.indptr, self.indices, self.blocks, values, result, a, b))
        return result

    def inverses(self, held: NDArray[np.bool_]) -> Blocks:
        """Inverses (n, 3, 3) of the diagonal blocks; `held` (n, 3) ones and those without stiffness rest."""
        return _inverses(self.indptr, self.indices, self.blocks, held)

    def sweep_from_zero(self, inverses: Blocks, right: Blocks) -> tuple[Blocks, Blocks]:
        """A forward sweep on A x = right (n, 3) from x = 0; the result and what is left of the right side."""
        solution, left = np.zeros_like(right), np.zeros_like(right)
        rows = self.indptr, self.indices, self.blocks
        free, apart = self._order
        _each(free, lambda a, b: _sweep_from_zero(*rows, inverses, right, solution, False, a, b))
        _each(apart, lambda a, b: _sweep_from_zero(*rows, inverses, right, solution, True, a, b))
        _each(free, lambda a, b: _left_after_sweep(*rows, solution, left, False, a, b))
        _each(apart, lambda a, b: _left_after_sweep(*rows, solution, left, True, a, b))
        return solution, left

    def sweep_back(self, inverses: Blocks, right: Blocks, solution: Blocks) -> None:
        """A backward sweep on A x = right (n, 3) from x = solution, which is changed."""
        rows = self.indptr, self.indices, self.blocks
        for spans in reversed(self._order):
            _each(spans, lambda a, b: _sweep_back(*rows, inverses, right, solution, a, b))

    @cached_property
    def _order(self) -> tuple[list[Span], list[Span]]:
        """Spans that do not see each other, and the ranges of rows between them that come last."""
        free, apart = [], []
        firsts = self.indices[self.indptr[:-1].clip(max=len(self.indices) - 1)]
        for first, end in self._spans:
            coupled = np.flatnonzero(firsts[first:end] < first)
            wide = int(coupled[-1]) + 1 if len(coupled) else 0
            if 2 * wide > end - first:  # numbered without regard to place, or too small to be cut
                return [(0, len(self.indptr) - 1)], []
            if wide:
                apart.append((first, first + wide))
            free.append((first + wide, end))
        return free, apart


def _each(spans: Sequence[Span], work: Callable[[int, int], None]) -> None:
    if len(spans) == 1:
        work(*spans[0])
    elif spans:
        list(_threads.map(work, *zip(*spans, strict=True)))


@njit(cache=True, nogil=True)
def _inverses(indptr: Index, indices: Index, blocks: Blocks, held: NDArray[np.bool_]) -> Blocks:
    inverses = np.zeros((len(held), 3, 3), dtype=blocks.dtype)
    block, still = np.zeros((3, 3)), np.zeros(3, dtype=np.bool_)
    for n in range(len(held)):
        for k in range(indptr[n], indptr[n + 1]):
            if indices[k] == n:
                block[:] = blocks[k]
                break
        else:
            continue
        for i in range(3):
            still[i] = held[n, i] or not block[i, i] > 0.0
        for i in range(3):
            for j in range(3):
                if still[i] or still[j]:
                    block[i, j] = 1.0 if i == j else 0.0
        determinant = 0.0
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            determinant += block[0, i] * (block[1, j] * block[2, k] - block[1, k] * block[2, j])
        for i in range(3):
            for j in range(3):
                if not (still[i] or still[j]):
                    a, b, c, d = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
                    inverses[n, j, i] = (block[a, c] * block[b, d] - block[a, d] * block[b, c]) / determinant
    return inverses


@njit(cache=True, nogil=True, fastmath=_FAST)
def _product(
    indptr: Index, indices: Index, blocks: Blocks, values: Blocks, result: Blocks, first: int, end: int
) -> None:
    for i in range(first, end):
        x = y = z = values.dtype.type(0)
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            u, v, w = values[j, 0], values[j, 1], values[j, 2]
            x += blocks[k, 0, 0] * u + blocks[k, 0, 1] * v + blocks[k, 0, 2] * w
            y += blocks[k, 1, 0] * u + blocks[k, 1, 1] * v + blocks[k, 1, 2] * w
            z += blocks[k, 2, 0] * u + blocks[k, 2, 1] * v + blocks[k, 2, 2] * w
        result[i, 0], result[i, 1], result[i, 2] = x, y, z


@njit(cache=True, nogil=True, fastmath=_FAST)
def _sweep_from_zero(
    indptr: Index,
    indices: Index,
    blocks: Blocks,
    inverses: Blocks,
    right: Blocks,
    solution: Blocks,
    others: bool,
    first: int,
    end: int,
) -> None:
    """Sweep the rows from `first` to `end`; where `others`, all rows outside have been swept, else none."""
    for i in range(first, end):
        x, y, z = right[i, 0], right[i, 1], right[i, 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if i <= j < end or not (others or first <= j < end):
                continue
            u, v, w = solution[j, 0], solution[j, 1], solution[j, 2]
            x -= blocks[k, 0, 0] * u + blocks[k, 0, 1] * v + blocks[k, 0, 2] * w
            y -= blocks[k, 1, 0] * u + blocks[k, 1, 1] * v + blocks[k, 1, 2] * w
            z -= blocks[k, 2, 0] * u + blocks[k, 2, 1] * v + blocks[k, 2, 2] * w
        for c in range(3):
            solution[i, c] = inverses[i, c, 0] * x + inverses[i, c, 1] * y + inverses[i, c, 2] * z


@njit(cache=True, nogil=True, fastmath=_FAST)
def _left_after_sweep(
    indptr: Index,
    indices: Index,
    blocks: Blocks,
    solution: Blocks,
    left: Blocks,
    others: bool,
    first: int,
    end: int,
) -> None:
    """Right side less the product: minus the sum over what was swept after each row, since the sweep made it exact."""
    for i in range(first, end):
        x = y = z = left.dtype.type(0)
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if not (i < j < end or not (others or first <= j < end)):
                continue
            u, v, w = solution[j, 0], solution[j, 1], solution[j, 2]
            x -= blocks[k, 0, 0] * u + blocks[k, 0, 1] * v + blocks[k, 0, 2] * w
            y -= blocks[k, 1, 0] * u + blocks[k, 1, 1] * v + blocks[k, 1, 2] * w
            z -= blocks[k, 2, 0] * u + blocks[k, 2, 1] * v + blocks[k, 2, 2] * w
        left[i, 0], left[i, 1], left[i, 2] = x, y, z


@njit(cache=True, nogil=True, fastmath=_FAST)
def _sweep_back(
    indptr: Index,
    indices: Index,
    blocks: Blocks,
    inverses: Blocks,
    right: Blocks,
    solution: Blocks,
    first: int,
    end: int,
) -> None:
    for i in range(end - 1, first - 1, -1):
        x, y, z = right[i, 0], right[i, 1], right[i, 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            if j == i:
                continue
            u, v, w = solution[j, 0], solution[j, 1], solution[j, 2]
            x -= blocks[k, 0, 0] * u + blocks[k, 0, 1] * v + blocks[k, 0, 2] * w
            y -= blocks[k, 1, 0] * u + blocks[k, 1, 1] * v + blocks[k, 1, 2] * w
            z -= blocks[k, 2, 0] * u + blocks[k, 2, 1] * v + blocks[k, 2, 2] * w
        for c in range(3):
            solution[i, c] = inverses[i, c, 0] * x + inverses[i, c, 1] * y + inverses[i, c, 2] * z
