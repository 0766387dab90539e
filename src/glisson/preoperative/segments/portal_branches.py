"""Segments of the portal vein's branches, from a landmark on each."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.landmarks import Landmarks
from glisson.core.structures import VesselTree
from glisson.preoperative.segments.landmarks import BIFURCATION, BRANCHES

_REACH_MM = 20.0
"""A landmark farther than this from every branch is a slip."""


def branch_segments(trees: tuple[VesselTree, ...], landmarks: Landmarks) -> tuple[FloatArray, IntArray]:
    """Centreline points (n, 3) in LPS mm that belong to one segment, and their segments (n,).

    The tree is followed from the bifurcation. A point belongs to the segment whose landmarks alone lie on it or
    beyond; a twig without a landmark to the segment that it leaves. The trunk, from which several segments are fed,
    belongs to none, and neither do twigs that leave it or pieces of the tree without a landmark.

    Raises:
        BadInput: there is no tree, or a landmark is missing or far from every branch.
    """
    if not trees:
        raise BadInput("There is no portal tree to follow; give the portal vein's mask, or use planes.")
    landmarks.require((BIFURCATION, *BRANCHES))
    starts = np.cumsum([0, *(len(tree.points_mm) for tree in trees)])
    points = np.concatenate([tree.points_mm for tree in trees])
    edges = np.concatenate([tree.edges + start for tree, start in zip(trees, starts[:-1], strict=True)])
    fed = _fed(points, edges, landmarks)
    numbers: IntArray = np.where((fed & (fed - 1)) == 0, np.log2(np.maximum(fed, 1)), 0.0).astype(np.int64)
    lost = sorted(set(BRANCHES.values()) - set(numbers.tolist()))
    if lost:
        raise BadInput(
            f"The landmarks P{', P'.join(map(str, lost))} lie on the trunk that feeds other segments too; "
            "set them farther out."
        )
    return points[numbers > 0], numbers[numbers > 0]


def _fed(points: FloatArray, edges: IntArray, landmarks: Landmarks) -> IntArray:
    """Segments that each point (n,) feeds, one bit each."""
    fed = np.zeros(len(points), dtype=np.int64)
    for name, number in BRANCHES.items():
        for place in landmarks.points_mm[name]:
            distance = np.linalg.norm(points - place, axis=1)
            if distance.min() > _REACH_MM:
                raise BadInput(f"The landmark {name!r} lies {distance.min():.0f} mm from every portal branch; move it.")
            fed[distance.argmin()] |= 1 << number
    graph = coo_array((np.ones(len(edges)), edges.T), shape=(len(points),) * 2).tocsr()
    bifurcation = landmarks.one(BIFURCATION)
    count, piece = connected_components(graph, directed=False)
    for number in range(count):
        own = np.flatnonzero(piece == number)
        root = own[np.linalg.norm(points[own] - bifurcation, axis=1).argmin()]
        order, before = breadth_first_order(graph, root, directed=False)
        for point in order[:0:-1]:
            fed[before[point]] |= fed[point]
        for point in order[1:]:
            fed[point] = fed[point] or fed[before[point]]
    return fed
