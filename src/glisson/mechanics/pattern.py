"""The fixed sparsity of the stiffness: found once from the elements, filled many times."""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix

from glisson.core.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class BlockPattern:
    """Rows of 3 × 3 blocks, one block for every pair of nodes that share an element.

    `indptr` (n + 1,) and `indices` are those of a block CSR matrix with sorted columns; `slots` (m, a, a)
    is the block number of each node pair of each element.
    """

    indptr: IntArray
    indices: IntArray
    slots: IntArray

    @property
    def block_count(self) -> int:
        """Number of 3 × 3 blocks."""
        return len(self.indices)

    def add_diagonal(self, values: FloatArray, blocks: FloatArray) -> None:
        """Add to all three unknowns of each node its value (n,)."""
        rows = np.repeat(np.arange(len(self.indptr) - 1), np.diff(self.indptr))
        own = np.flatnonzero(rows == self.indices)
        blocks[own] += values[:, None, None] * np.eye(3)

    def matrix(self, blocks: FloatArray) -> bsr_matrix:
        """The matrix of block values (b, 3, 3), over all unknowns."""
        return bsr_matrix((blocks, self.indices, self.indptr))


def block_pattern(tetrahedra: IntArray, node_count: int) -> BlockPattern:
    """Pattern of the elements (m, a) over `node_count` nodes."""
    size = tetrahedra.shape[1]
    rows = np.repeat(tetrahedra, size, axis=1).ravel()
    columns = np.tile(tetrahedra, (1, size)).ravel()
    graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), (node_count, node_count)).tocsr()
    graph.sort_indices()
    indptr, indices = graph.indptr.astype(np.int64), graph.indices.astype(np.int64)
    slots = _find_slots(indptr, indices, tetrahedra, tetrahedra)
    return BlockPattern(indptr, indices, slots)


def pair_slots(pattern: BlockPattern, nodes: IntArray) -> IntArray:
    """Block numbers (p, a, a) of all pairs within each row of `nodes` (p, a), which must share elements."""
    result: IntArray = _find_slots(pattern.indptr, pattern.indices, nodes, nodes)
    return result


@njit(cache=True)
def _find_slots(indptr: IntArray, indices: IntArray, rows: IntArray, columns: IntArray) -> IntArray:
    count, size = rows.shape
    slots = np.zeros((count, size, size), dtype=np.int64)
    for e in range(count):
        for a in range(size):
            start, end = indptr[rows[e, a]], indptr[rows[e, a] + 1]
            for b in range(size):
                slots[e, a, b] = start + np.searchsorted(indices[start:end], columns[e, b])
    return slots


class FreeSystem:
    """The rows and columns of the free unknowns: upper triangle as CSR, filled from the blocks.

    Args:
        pattern: the blocks.
        fixed: (3 n,) which unknowns are held.
    """

    def __init__(self, pattern: BlockPattern, fixed: NDArray[np.bool_]) -> None:
        self.free = np.flatnonzero(~fixed)
        number = np.full(len(fixed), -1, dtype=np.int64)
        number[self.free] = np.arange(len(self.free))
        self.indptr, self.indices, self._sources = _upper_triangle(
            pattern.indptr, pattern.indices, number, len(self.free)
        )

    def matrix(self, blocks: FloatArray) -> csr_matrix:
        """Upper triangle, diagonal included, of the matrix of block values (b, 3, 3)."""
        data = blocks.ravel()[self._sources]
        size = len(self.free)
        return csr_matrix((data, self.indices, self.indptr), (size, size))


@njit(cache=True)
def _upper_triangle(
    indptr: IntArray, indices: IntArray, number: IntArray, size: int
) -> tuple[NDArray[np.int32], NDArray[np.int32], IntArray]:
    starts = np.zeros(size + 1, dtype=np.int32)
    for node in range(len(indptr) - 1):
        for i in range(3):
            row = number[3 * node + i]
            if row < 0:
                continue
            for slot in range(indptr[node], indptr[node + 1]):
                for j in range(3):
                    if number[3 * indices[slot] + j] >= row:
                        starts[row + 1] += 1
    for row in range(size):
        starts[row + 1] += starts[row]
    columns = np.zeros(starts[size], dtype=np.int32)
    sources = np.zeros(starts[size], dtype=np.int64)
    for node in range(len(indptr) - 1):
        for i in range(3):
            row = number[3 * node + i]
            if row < 0:
                continue
            place = starts[row]
            for slot in range(indptr[node], indptr[node + 1]):
                for j in range(3):
                    column = number[3 * indices[slot] + j]
                    if column >= row:
                        columns[place] = column
                        sources[place] = 9 * slot + 3 * i + j
                        place += 1
    return starts, columns, sources
