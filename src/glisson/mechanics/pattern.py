"""The fixed sparsity of the stiffness: found once from the elements, filled many times."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix, coo_matrix, csr_matrix

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.block_rows import BlockRows, Blocks
from glisson.mechanics.symmetric_rows import HalfPattern, SymmetricRows

Index = NDArray[np.int32]
"""Half the memory of `IntArray`: patterns are as large as the matrix itself."""


@dataclass(frozen=True, eq=False)
class BlockPattern:
    """Rows of 3 × 3 blocks, one block for every pair of nodes that share an element.

    `indptr` (n + 1,) and `indices` are those of a block CSR matrix with sorted columns; `slots` (m, a, a)
    is the block number of each node pair of each of the elements (m, a).
    """

    indptr: Index
    indices: Index
    tetrahedra: IntArray
    slots: Index

    @property
    def block_count(self) -> int:
        """Number of 3 × 3 blocks."""
        return len(self.indices)

    def covers(self, groups: IntArray) -> bool:
        """Whether there is a block for every pair of nodes of each of the groups (k, a)."""
        return bool((pair_slots(self, groups) >= 0).all())

    def with_groups(self, groups: Sequence[IntArray]) -> "BlockPattern":
        """A pattern with also a block for every pair of nodes of the groups, arrays (k, a)."""
        count = len(self.indptr) - 1
        graph = csr_matrix((np.ones(self.block_count, dtype=np.bool_), self.indices, self.indptr), (count, count))
        return _pattern_of(sum((_graph(nodes, count) for nodes in groups), graph), self.tetrahedra)

    def add_groups(self, groups: IntArray, local: FloatArray, blocks: FloatArray) -> None:
        """Add matrices (k, a, a, 3, 3) of groups of nodes (k, a), which the pattern covers, to the blocks."""
        np.add.at(blocks, pair_slots(self, groups).ravel(), local.reshape(-1, 3, 3))

    def add_diagonal(self, values: FloatArray, blocks: FloatArray) -> None:
        """Add to all three unknowns of each node its value (n,)."""
        blocks[self._diagonal] += values[:, None, None] * np.eye(3)

    def diagonal(self, blocks: FloatArray) -> FloatArray:
        """The diagonal entries (n, 3)."""
        entries: FloatArray = np.einsum("nii->ni", blocks[self._diagonal])
        return entries

    @cached_property
    def _diagonal(self) -> IntArray:
        rows = np.repeat(np.arange(len(self.indptr) - 1), np.diff(self.indptr))
        return np.flatnonzero(rows == self.indices)

    @cached_property
    def half(self) -> HalfPattern:
        """What is kept of symmetric matrices for products and sweeps."""
        return HalfPattern(self.indptr, self.indices)

    def matrix(self, blocks: FloatArray) -> bsr_matrix:
        """The matrix of block values (b, 3, 3), over all unknowns."""
        return bsr_matrix((blocks, self.indices, self.indptr))


def block_pattern(tetrahedra: IntArray, node_count: int) -> BlockPattern:
    """Pattern of the elements (m, a) over `node_count` nodes."""
    return _pattern_of(_graph(tetrahedra, node_count), tetrahedra)


def _graph(groups: IntArray, node_count: int) -> csr_matrix:
    """Which nodes share one of the groups (m, a)."""
    size = groups.shape[1]
    rows = np.repeat(groups, size, axis=1).ravel()
    columns = np.tile(groups, (1, size)).ravel()
    return coo_matrix((np.ones(len(rows), dtype=np.bool_), (rows, columns)), (node_count, node_count)).tocsr()


def _pattern_of(graph: csr_matrix, tetrahedra: IntArray) -> BlockPattern:
    graph.sort_indices()
    indptr, indices = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    return BlockPattern(indptr, indices, tetrahedra, _find_slots(indptr, indices, tetrahedra, tetrahedra))


def pair_slots(pattern: BlockPattern, nodes: IntArray) -> Index:
    """Block numbers (p, a, a) of all pairs within each row of `nodes` (p, a); −1 where there is no block."""
    result: Index = _find_slots(pattern.indptr, pattern.indices, nodes, nodes)
    return result


@njit(cache=True)
def _find_slots(indptr: Index, indices: Index, rows: IntArray, columns: IntArray) -> Index:
    count, size = rows.shape
    slots = np.zeros((count, size, size), dtype=np.int32)
    for e in range(count):
        for a in range(size):
            start, end = indptr[rows[e, a]], indptr[rows[e, a] + 1]
            for b in range(size):
                place = start + np.searchsorted(indices[start:end], columns[e, b])
                slots[e, a, b] = place if place < end and indices[place] == columns[e, b] else -1
    return slots


class FreeSystem:
    """The rows and columns of the free unknowns: upper triangle as CSR, filled from the blocks.

    Args:
        pattern: the blocks.
        fixed: (n, 3) which unknowns are held.
    """

    def __init__(self, pattern: BlockPattern, fixed: NDArray[np.bool_]) -> None:
        self.held = fixed
        self.free = np.flatnonzero(~fixed.ravel())
        number = np.full(fixed.size, -1, dtype=np.int64)
        number[self.free] = np.arange(len(self.free))
        self.indptr, self.indices, self._sources = _upper_triangle(
            pattern.indptr, pattern.indices, number, len(self.free)
        )

    def restrict(self, field: FloatArray) -> FloatArray:
        """The values (f,) of a nodal field (n, 3) at the free unknowns."""
        return field.ravel()[self.free]

    def extend(self, values: FloatArray) -> FloatArray:
        """The nodal field (n, 3) with these values (f,) at the free unknowns, zero at the held ones."""
        field = np.zeros_like(self.held, dtype=np.float64)
        field.ravel()[self.free] = values
        return field

    def matrix(self, blocks: FloatArray) -> csr_matrix:
        """Upper triangle, diagonal included, of the matrix of block values (b, 3, 3)."""
        data = blocks.ravel()[self._sources]
        size = len(self.free)
        return csr_matrix((data, self.indices, self.indptr), (size, size))


@dataclass(frozen=True, eq=False)
class Stiffness:
    """A matrix of block values (b, 3, 3) at node positions (n, 3) in mm, some unknowns being held."""

    pattern: BlockPattern
    system: FreeSystem
    blocks: FloatArray
    positions: FloatArray

    @property
    def held(self) -> NDArray[np.bool_]:
        """Which unknowns (n, 3) are held."""
        return self.system.held

    @property
    def upper(self) -> csr_matrix:
        """Upper triangle of the free unknowns' matrix, where it is symmetric."""
        return self.system.matrix(self.blocks)

    def product(self, field: FloatArray) -> FloatArray:
        """The forces (n, 3) on free unknowns of a nodal field (n, 3) that vanishes on the held ones."""
        return self._on_free(self._rows.product(field))

    def symmetric_product(self, field: FloatArray) -> FloatArray:
        """The same where the matrix is symmetric, in less than half the time."""
        return self._on_free(self._symmetric_rows.product(field))

    def _on_free(self, product: Blocks) -> FloatArray:
        forces = product.astype(np.float64, copy=False)
        forces[self.held] = 0.0
        return forces

    @cached_property
    def _rows(self) -> BlockRows:
        return BlockRows(self.pattern.indptr, self.pattern.indices, self.blocks)

    @cached_property
    def _symmetric_rows(self) -> SymmetricRows:
        return SymmetricRows(self.pattern.half, self.blocks, np.float64)


@njit(cache=True)
def _upper_triangle(
    indptr: Index, indices: Index, number: IntArray, size: int
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
