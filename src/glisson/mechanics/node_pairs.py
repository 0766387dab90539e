"""A sparse Hessian over some nodes as the groups of two that a `Part` gives."""

import numpy as np
from scipy.sparse import spmatrix

from glisson.core.arrays import FloatArray, IntArray


def node_pairs(hessian: spmatrix, nodes: IntArray) -> tuple[IntArray, FloatArray]:
    """Pairs (k, 2) of the nodes (n,) that a symmetric Hessian (3n, 3n) couples, or of one with itself, and its blocks.

    The blocks (k, 2, 2, 3, 3) add up to the Hessian.
    """
    blocks = hessian.tobsr((3, 3))
    blocks.sum_duplicates()
    rows = np.repeat(np.arange(len(nodes)), np.diff(blocks.indptr))
    upper = rows <= blocks.indices
    rows, columns, data = rows[upper], blocks.indices[upper], blocks.data[upper]
    local = np.zeros((len(rows), 2, 2, 3, 3))
    apart = rows != columns
    local[~apart, 0, 0] = data[~apart]
    local[apart, 0, 1] = data[apart]
    local[apart, 1, 0] = data[apart].transpose(0, 2, 1)
    return np.column_stack([nodes[rows], nodes[columns]]), local
