"""A tree of axis-parallel bounding boxes over many small bodies (elements, triangles).

The tree splits at the median of the box centres along the widest axis; its query loops live with the
queries themselves, since numba compiles each with its own leaf test.
"""

from typing import NamedTuple

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.compiled import compiled

LEAF_SIZE = 4
STACK_SIZE = 128
"""Depth-first traversal of a median-split tree needs one entry a level, so this is never full."""


class BoxTree(NamedTuple):
    """Nodes of the tree. Leaves have `left` −1 and hold `order[first : first + size]`.

    `lower`, `upper` are (k, 3) in mm, `left` (k,) is the first of two adjacent children, `order` (n,)
    the bodies' numbers.
    """

    lower: FloatArray
    upper: FloatArray
    left: IntArray
    first: IntArray
    size: IntArray
    order: IntArray


def build_box_tree(lower: FloatArray, upper: FloatArray) -> BoxTree:
    """Tree over bodies with box corners `lower` and `upper`, each (n, 3) with n ≥ 1, in mm."""
    return BoxTree(*_build(np.ascontiguousarray(lower), np.ascontiguousarray(upper)))


@compiled
def _build(
    lower: FloatArray, upper: FloatArray
) -> tuple[FloatArray, FloatArray, IntArray, IntArray, IntArray, IntArray]:
    bodies = len(lower)
    room = 4 * (bodies // LEAF_SIZE + 1) + 3
    node_lower = np.zeros((room, 3))
    node_upper = np.zeros((room, 3))
    left = np.full(room, -1)
    first = np.zeros(room, dtype=np.int64)
    size = np.zeros(room, dtype=np.int64)
    order = np.arange(bodies)
    size[0] = bodies
    used = 1
    node = 0
    while node < used:
        start, stop = first[node], first[node] + size[node]
        for axis in range(3):
            least, greatest = np.inf, -np.inf
            for slot in range(start, stop):
                least = min(least, lower[order[slot], axis])
                greatest = max(greatest, upper[order[slot], axis])
            node_lower[node, axis], node_upper[node, axis] = least, greatest
        if size[node] > LEAF_SIZE:
            widest = np.argmax(node_upper[node] - node_lower[node])
            chosen = order[start:stop].copy()
            order[start:stop] = chosen[np.argsort(lower[chosen, widest] + upper[chosen, widest])]
            left[node] = used
            half = size[node] // 2
            first[used], size[used] = start, half
            first[used + 1], size[used + 1] = start + half, size[node] - half
            used += 2
        node += 1
    return node_lower[:used], node_upper[:used], left[:used], first[:used], size[:used], order


def refitted(tree: BoxTree, corners: FloatArray) -> BoxTree:
    """The tree with its boxes around bodies that have moved: their corners (n, c, 3) are now there, in mm."""
    lower, upper = _refitted(tree.left, tree.first, tree.size, tree.order, corners)
    return tree._replace(lower=lower, upper=upper)


@compiled
def _refitted(
    left: IntArray, first: IntArray, size: IntArray, order: IntArray, corners: FloatArray
) -> tuple[FloatArray, FloatArray]:
    lower, upper = np.full((len(left), 3), np.inf), np.full((len(left), 3), -np.inf)
    for node in range(len(left) - 1, -1, -1):  # children come after their parent
        for axis in range(3):
            if left[node] >= 0:
                one, other = left[node], left[node] + 1
                lower[node, axis] = min(lower[one, axis], lower[other, axis])
                upper[node, axis] = max(upper[one, axis], upper[other, axis])
                continue
            for slot in range(first[node], first[node] + size[node]):
                for corner in range(corners.shape[1]):
                    place = corners[order[slot], corner, axis]
                    lower[node, axis] = min(lower[node, axis], place)
                    upper[node, axis] = max(upper[node, axis], place)
    return lower, upper


@compiled
def squared_distance_to_box(point: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    """Squared distance (mm²) of a point (3,) to a box with corners (3,); 0 inside."""
    total = 0.0
    for axis in range(3):
        outside = max(lower[axis] - point[axis], point[axis] - upper[axis], 0.0)
        total += outside * outside
    return total
