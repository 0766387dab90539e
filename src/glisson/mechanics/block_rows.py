"""Products with matrices of 3 × 3 blocks by rows, and rows shared out among the cores."""

import itertools
import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
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
_FEWEST = 10_000  # blocks for each core: with less it would take longer to tell than to do
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
        self._spans = row_spans(indptr)

    @classmethod
    def of(cls, matrix: bsr_matrix, precision: type[np.floating[Any]]) -> "BlockRows":
        """A sparse matrix, cut into 3 × 3 blocks."""
        cut = matrix.tobsr((3, 3))
        cut.sort_indices()
        return cls(cut.indptr, cut.indices, cut.data.astype(precision))

    def product(self, values: Blocks) -> Blocks:
        """The product (n, 3) with values (m, 3)."""
        result = np.zeros((len(self.indptr) - 1, 3), dtype=values.dtype)
        each_span(self._spans, lambda a, b: _product(self.indptr, self.indices, self.blocks, values, result, a, b))
        return result


def times(left: bsr_matrix, right: bsr_matrix) -> bsr_matrix:
    """The product of two matrices of blocks, the rows shared out among the cores: SciPy multiplies without a lock."""
    found: dict[int, bsr_matrix] = {}

    def multiply(first: int, end: int) -> None:
        begin, stop = left.indptr[first], left.indptr[end]
        rows = (left.data[begin:stop], left.indices[begin:stop], left.indptr[first : end + 1] - begin)
        found[first] = bsr_matrix(rows, shape=((end - first) * left.blocksize[0], left.shape[1])) @ right

    each_span(row_spans(left.indptr), multiply)
    parts = [found[first] for first in sorted(found)]
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(part.indptr[-1] for part in parts)])
    indptr = np.concatenate([[0], *(part.indptr[1:] + start for part, start in zip(parts, starts, strict=False))])
    blocks = np.concatenate([part.data for part in parts])
    indices = np.concatenate([part.indices for part in parts])
    return bsr_matrix((blocks, indices, indptr), shape=(left.shape[0], right.shape[1]))


def row_spans(indptr: Index) -> list[Span]:
    """Rows shared out among the cores, as many blocks for each; all to one where they are few."""
    cores = _CORES if indptr[-1] >= _CORES * _FEWEST else 1
    cuts = np.searchsorted(indptr, np.linspace(0, indptr[-1], cores + 1))
    cuts[0], cuts[-1] = 0, len(indptr) - 1
    return _between(cuts)


def even_spans(count: int) -> list[Span]:
    """Numbers up to `count` shared out among the cores."""
    return _between(np.linspace(0, count, _CORES + 1).astype(np.int64))


def each_span(spans: Sequence[Span], work: Callable[[int, int], None]) -> None:
    """Do the work for each span from its first to before its end, all at the same time."""
    if len(spans) == 1:
        work(*spans[0])
    elif spans:
        list(_threads.map(work, *zip(*spans, strict=True)))


def _between(cuts: NDArray[np.int64]) -> list[Span]:
    return [(int(a), int(b)) for a, b in itertools.pairwise(cuts) if b > a]


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
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
