"""Products and Gauss–Seidel sweeps with symmetric matrices of 3 × 3 blocks, on all cores.

Time goes into reading the matrix. So only the half of it that lies before the diagonal is kept, and every block is used
for its own row and, transposed, for that of its column while it is at hand.

Rows are cut into one span for each core. Rows at the start of a span that couple to the one before are set apart:
spans without them do not see each other, so that cores can sweep them at the same time, and the rows set apart come
after them. The outcome is that of one core that takes the rows in this order.
"""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from glisson.mechanics.block_rows import Blocks, Index, Span, each_span, even_spans, row_spans

_FAST = {"contract", "reassoc", "nsz"}


class HalfPattern:
    """The blocks before the diagonal in the order of a sweep.

    Args:
        indptr: (n + 1,) first block of each row of the whole symmetric pattern.
        indices: (b,) block columns, ascending in each row.
    """

    def __init__(self, indptr: Index, indices: Index) -> None:
        count = len(indptr) - 1
        self.free, self.apart = _order(indptr, indices)
        rank = np.zeros(count, dtype=np.int64)
        order = [np.arange(*span) for span in (*self.free, *self.apart)]
        rank[np.concatenate(order)] = np.arange(count)
        rows = np.repeat(np.arange(count, dtype=np.int32), np.diff(indptr))
        self.slots = np.flatnonzero(rank[indices] < rank[rows])
        self.indptr = np.zeros(count + 1, dtype=np.uint64)
        self.indptr[1:] = np.cumsum(np.bincount(rows[self.slots], minlength=count))
        self.indices = indices[self.slots].astype(np.uint32)
        self.diagonal = np.full(count, -1, dtype=np.int64)  # none in a row without blocks
        on_it = np.flatnonzero(rows == indices)
        self.diagonal[rows[on_it]] = on_it


class SymmetricRows:
    """A symmetric matrix of 3 × 3 blocks.

    Args:
        half: what of it is kept.
        blocks: (b, 3, 3) of the whole pattern.
        precision: in which they are kept.
    """

    def __init__(self, half: HalfPattern, blocks: Blocks, precision: type[np.floating[Any]]) -> None:
        self._half = half
        self._lower = np.zeros((len(half.slots), 3, 3), dtype=precision)
        each_span(even_spans(len(half.slots)), lambda a, b: _take(blocks, half.slots, self._lower, a, b))
        self._diagonal = np.zeros((len(half.diagonal), 3, 3), dtype=precision)
        there = half.diagonal >= 0
        self._diagonal[there] = blocks[half.diagonal[there]]

    def product(self, values: Blocks) -> Blocks:
        """The product (n, 3) with values (n, 3)."""
        result = np.zeros_like(values)
        self._forward(lambda a, b: _product(*self._rows, self._diagonal, values, result, a, b))
        return result

    def inverses(self, held: NDArray[np.bool_]) -> Blocks:
        """Inverses (n, 3, 3) of the diagonal blocks; `held` (n, 3) ones and those without stiffness rest."""
        return _inverses(self._diagonal, held)

    def sweep_from_zero(self, inverses: Blocks, right: Blocks) -> tuple[Blocks, Blocks]:
        """A forward sweep on A x = right (n, 3) from x = 0; the result and what is left of the right side."""
        solution, left = np.zeros_like(right), np.zeros_like(right)
        self._forward(lambda a, b: _sweep_from_zero(*self._rows, inverses, right, solution, left, a, b))
        return solution, left

    def sweep_back(self, inverses: Blocks, right: Blocks, solution: Blocks) -> None:
        """A backward sweep on A x = right (n, 3) from x = solution, which is changed."""
        left = right.copy()
        for first, end in reversed(self._half.apart):
            _sweep_back(*self._rows, inverses, left, solution, first, end)
        each_span(self._half.free, lambda a, b: _sweep_back(*self._rows, inverses, left, solution, a, b))

    def _forward(self, work: Callable[[int, int], None]) -> None:
        """Free spans at the same time, then those apart one by one: they change what belongs to others."""
        each_span(self._half.free, work)
        for span in self._half.apart:
            work(*span)

    @cached_property
    def _rows(self) -> tuple[Index, Index, Blocks]:
        return self._half.indptr, self._half.indices, self._lower


def _order(indptr: Index, indices: Index) -> tuple[list[Span], list[Span]]:
    """Spans of rows that do not see each other, and the ranges of rows between them that come last."""
    free, apart = [], []
    firsts = indices[indptr[:-1].clip(max=len(indices) - 1)]
    for first, end in row_spans(indptr):
        coupled = np.flatnonzero(firsts[first:end] < first)
        wide = int(coupled[-1]) + 1 if len(coupled) else 0
        if 2 * wide > end - first:  # numbered without regard to place, or too small to be cut
            return [(0, len(indptr) - 1)], []
        if wide:
            apart.append((first, first + wide))
        free.append((first + wide, end))
    return free, apart


@njit(cache=True, nogil=True)
def _take(blocks: Blocks, slots: Index, taken: Blocks, first: int, end: int) -> None:
    for k in range(first, end):
        slot = slots[k]
        for i in range(3):
            for j in range(3):
                taken[k, i, j] = blocks[slot, i, j]


@njit(cache=True, nogil=True)
def _inverses(diagonal: Blocks, held: NDArray[np.bool_]) -> Blocks:
    inverses = np.zeros_like(diagonal)
    block, still = np.zeros((3, 3)), np.zeros(3, dtype=np.bool_)
    for n in range(len(held)):
        block[:] = diagonal[n]
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
    indptr: Index, indices: Index, lower: Blocks, diagonal: Blocks, values: Blocks, result: Blocks, first: int, end: int
) -> None:
    for i in range(first, end):
        p, q, r = values[i, 0], values[i, 1], values[i, 2]
        x = diagonal[i, 0, 0] * p + diagonal[i, 0, 1] * q + diagonal[i, 0, 2] * r
        y = diagonal[i, 1, 0] * p + diagonal[i, 1, 1] * q + diagonal[i, 1, 2] * r
        z = diagonal[i, 2, 0] * p + diagonal[i, 2, 1] * q + diagonal[i, 2, 2] * r
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            u, v, w = values[j, 0], values[j, 1], values[j, 2]
            x += lower[k, 0, 0] * u + lower[k, 0, 1] * v + lower[k, 0, 2] * w
            y += lower[k, 1, 0] * u + lower[k, 1, 1] * v + lower[k, 1, 2] * w
            z += lower[k, 2, 0] * u + lower[k, 2, 1] * v + lower[k, 2, 2] * w
            result[j, 0] += lower[k, 0, 0] * p + lower[k, 1, 0] * q + lower[k, 2, 0] * r
            result[j, 1] += lower[k, 0, 1] * p + lower[k, 1, 1] * q + lower[k, 2, 1] * r
            result[j, 2] += lower[k, 0, 2] * p + lower[k, 1, 2] * q + lower[k, 2, 2] * r
        result[i, 0] += x
        result[i, 1] += y
        result[i, 2] += z


@njit(cache=True, nogil=True, fastmath=_FAST)
def _sweep_from_zero(
    indptr: Index,
    indices: Index,
    lower: Blocks,
    inverses: Blocks,
    right: Blocks,
    solution: Blocks,
    left: Blocks,
    first: int,
    end: int,
) -> None:
    """Sweep the rows; `left` takes minus what later rows push earlier ones, which were exact when swept."""
    for i in range(first, end):
        x, y, z = right[i, 0], right[i, 1], right[i, 2]
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            u, v, w = solution[j, 0], solution[j, 1], solution[j, 2]
            x -= lower[k, 0, 0] * u + lower[k, 0, 1] * v + lower[k, 0, 2] * w
            y -= lower[k, 1, 0] * u + lower[k, 1, 1] * v + lower[k, 1, 2] * w
            z -= lower[k, 2, 0] * u + lower[k, 2, 1] * v + lower[k, 2, 2] * w
        p = inverses[i, 0, 0] * x + inverses[i, 0, 1] * y + inverses[i, 0, 2] * z
        q = inverses[i, 1, 0] * x + inverses[i, 1, 1] * y + inverses[i, 1, 2] * z
        r = inverses[i, 2, 0] * x + inverses[i, 2, 1] * y + inverses[i, 2, 2] * z
        solution[i, 0], solution[i, 1], solution[i, 2] = p, q, r
        for k in range(indptr[i], indptr[i + 1]):
            j = indices[k]
            left[j, 0] -= lower[k, 0, 0] * p + lower[k, 1, 0] * q + lower[k, 2, 0] * r
            left[j, 1] -= lower[k, 0, 1] * p + lower[k, 1, 1] * q + lower[k, 2, 1] * r
            left[j, 2] -= lower[k, 0, 2] * p + lower[k, 1, 2] * q + lower[k, 2, 2] * r


@njit(cache=True, nogil=True, fastmath=_FAST)
def _sweep_back(
    indptr: Index,
    indices: Index,
    lower: Blocks,
    inverses: Blocks,
    left: Blocks,
    solution: Blocks,
    first: int,
    end: int,
) -> None:
    """Sweep the rows; `left` is the right side less what rows swept before push these, and goes on so."""
    one = indptr.dtype.type(1)
    for i in range(end - 1, first - 1, -1):
        begin, stop = indptr[i], indptr[i + 1]
        x, y, z = left[i, 0], left[i, 1], left[i, 2]
        for back in range(begin, stop):
            k = stop - one - (back - begin)  # memory is read ahead in one direction only
            j = indices[k]
            u, v, w = solution[j, 0], solution[j, 1], solution[j, 2]
            x -= lower[k, 0, 0] * u + lower[k, 0, 1] * v + lower[k, 0, 2] * w
            y -= lower[k, 1, 0] * u + lower[k, 1, 1] * v + lower[k, 1, 2] * w
            z -= lower[k, 2, 0] * u + lower[k, 2, 1] * v + lower[k, 2, 2] * w
        p = inverses[i, 0, 0] * x + inverses[i, 0, 1] * y + inverses[i, 0, 2] * z
        q = inverses[i, 1, 0] * x + inverses[i, 1, 1] * y + inverses[i, 1, 2] * z
        r = inverses[i, 2, 0] * x + inverses[i, 2, 1] * y + inverses[i, 2, 2] * z
        solution[i, 0], solution[i, 1], solution[i, 2] = p, q, r
        for k in range(begin, stop):
            j = indices[k]
            left[j, 0] -= lower[k, 0, 0] * p + lower[k, 1, 0] * q + lower[k, 2, 0] * r
            left[j, 1] -= lower[k, 0, 1] * p + lower[k, 1, 1] * q + lower[k, 2, 1] * r
            left[j, 2] -= lower[k, 0, 2] * p + lower[k, 1, 2] * q + lower[k, 2, 2] * r
