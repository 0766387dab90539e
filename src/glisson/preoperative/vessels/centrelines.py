"""Centrelines of tubes: the skeleton of a mask as trees with radii.

The mask is thinned to one voxel (Lee, Kashyap and Chu 1994, in scikit-image), its voxels become a graph,
loops are cut where they cost most (minimum spanning tree), and spurs no longer than the tube is wide are
pruned. Thinning is up to a voxel off the middle and the distance to the nearest voxel outside, which guides
the pruning, up to a voxel too small: so each point is moved to the centroid of the tube's voxels about it,
and its radius is that of the circle with the tube's local cross-section, its volume over its length.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_array, csr_array, diags_array, eye_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree
from skimage.morphology import skeletonize

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.image import Grid
from glisson.geometry.distance_map import distance_inside

_SPUR = 1.5
"""A side branch shorter than this many radii of the tube that it leaves is a spur of the thinning."""


@dataclass(frozen=True, eq=False)
class Tree:
    """A rooted tree: points (n, 3) LPS mm, radii (n,) mm, parent of each point (n,); the root, 0, has -1."""

    points_mm: FloatArray
    radii_mm: FloatArray
    parents: IntArray

    @property
    def edges(self) -> IntArray:
        """Parent and child of each edge, (n - 1, 2)."""
        children = np.flatnonzero(self.parents >= 0)
        return np.stack([self.parents[children], children], axis=1)

    @property
    def length_mm(self) -> float:
        """Length of all edges together."""
        parent, child = self.edges.T
        return float(np.linalg.norm(self.points_mm[child] - self.points_mm[parent], axis=1).sum())


def centreline_trees(mask: NDArray[np.bool_], grid: Grid, smallest_mm: float = 0.0) -> tuple[Tree, ...]:
    """Centrelines of the separate tubes of a mask [i, j, k], the longest first.

    Each tree starts at the end nearest to its thickest point. Trees shorter than `smallest_mm` are left out.
    """
    points, radii = skeleton_points(mask, grid)
    if len(points) < 2:
        return ()
    graph = _spanning_tree(points, grid)
    count, part = connected_components(graph, directed=False)
    trees = []
    for n in range(count):
        members = np.flatnonzero(part == n)
        if len(members) >= 2:
            tree = _pruned(_rooted(points[members], radii[members], csr_array(graph[members][:, members])))
            trees.append(smoothed(tree))
    trees = centred(trees, mask, grid)
    kept = [tree for tree in trees if len(tree.points_mm) >= 2 and tree.length_mm >= smallest_mm]
    return tuple(sorted(kept, key=lambda tree: -tree.length_mm))


def longest_path(tree: Tree) -> IntArray:
    """Point numbers along the longest path of a tree, in order."""
    parent, child = tree.edges.T
    lengths = np.linalg.norm(tree.points_mm[child] - tree.points_mm[parent], axis=1)
    graph = coo_array((lengths, (parent, child)), shape=(len(tree.points_mm),) * 2).tocsr()
    start = int(np.argmax(dijkstra(graph, directed=False, indices=0)))
    distances, before = dijkstra(graph, directed=False, indices=start, return_predecessors=True)
    path = [int(np.argmax(distances))]
    while path[-1] != start:
        path.append(int(before[path[-1]]))
    return np.array(path, dtype=np.int64)


def skeleton_points(mask: NDArray[np.bool_], grid: Grid) -> tuple[FloatArray, FloatArray]:
    """LPS mm (n, 3) and radii (n,) of the voxels of a mask's skeleton."""
    box = ndimage.find_objects(mask.astype(np.uint8))
    if not box:
        return np.zeros((0, 3)), np.zeros(0)
    filled = np.pad(ndimage.binary_fill_holes(mask[box[0]]), 1)
    cells = np.argwhere(skeletonize(filled))
    inner = distance_inside(filled, grid.spacing_mm)
    least = float(grid.spacing_mm.min())
    radii = np.maximum(inner[tuple(cells.T)] - 0.5 * least, 0.5 * least)
    start = np.array([part.start for part in box[0]]) - 1
    return grid.points_from_indices(cells + start), radii


def _spanning_tree(points: FloatArray, grid: Grid) -> csr_array:
    """Minimum spanning forest of touching voxels; weights are lengths in mm."""
    return csr_array(minimum_spanning_tree(touching_voxels(points, grid)))


def touching_voxels(points: FloatArray, grid: Grid) -> csr_array:
    """Graph in which voxels (by their centres, LPS mm) are neighbours that touch, by a corner at least.

    The upper half of a symmetric matrix; weights are lengths in mm.
    """
    reach = float(np.linalg.norm(grid.spacing_mm)) * 1.001
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    apart = np.abs(grid.indices_from_points(points[pairs[:, 0]]) - grid.indices_from_points(points[pairs[:, 1]]))
    pairs = pairs[(apart < 1.5).all(axis=1)]
    lengths = np.linalg.norm(points[pairs[:, 1]] - points[pairs[:, 0]], axis=1)
    return csr_array(coo_array((lengths, (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2).tocsr())


def _rooted(points: FloatArray, radii: FloatArray, graph: csr_array) -> Tree:
    """The tree renumbered from the end that lies nearest to its thickest point along the tree."""
    both = csr_array(graph + graph.T)
    ends = np.flatnonzero(np.diff(both.indptr) == 1)
    along = dijkstra(both, indices=int(np.argmax(radii)))
    root = int(ends[np.argmin(along[ends])])
    order, before = breadth_first_order(both, root, directed=False)
    place = np.zeros(len(points), dtype=np.int64)
    place[order] = np.arange(len(order))
    parents = np.full(len(order), -1, dtype=np.int64)
    parents[1:] = place[before[order[1:]]]
    return Tree(points[order], radii[order], parents)


def _pruned(tree: Tree) -> Tree:
    """The tree without spurs, the shortest removed first, until none is left."""
    alive = np.ones(len(tree.points_mm), dtype=bool)
    while True:
        spurs = _spurs(tree, alive)
        if not spurs:
            return _kept(tree, alive)
        taken: set[int] = set()
        for _, branching, nodes in sorted(spurs, key=lambda spur: spur[0]):
            # One spur a branching and round: what is left of it may be no branching any more.
            if branching not in taken:
                taken.add(branching)
                alive[nodes] = False


def _spurs(tree: Tree, alive: NDArray[np.bool_]) -> list[tuple[float, int, list[int]]]:
    """Length, branching point and nodes of each short side branch."""
    children = np.bincount(tree.parents[alive & (tree.parents >= 0)], minlength=len(alive))
    found = []
    for leaf in np.flatnonzero(alive & (children == 0)):
        nodes, length, node = [], 0.0, int(leaf)
        while node != 0 and children[node] <= 1:
            parent = int(tree.parents[node])
            length += float(np.linalg.norm(tree.points_mm[node] - tree.points_mm[parent]))
            nodes.append(node)
            node = parent
        if children[node] > 1 and length < _SPUR * tree.radii_mm[node]:
            found.append((length, node, nodes))
    return found


def _kept(tree: Tree, alive: NDArray[np.bool_]) -> Tree:
    place = np.cumsum(alive) - 1
    parents = tree.parents[alive]
    return Tree(tree.points_mm[alive], tree.radii_mm[alive], np.where(parents < 0, -1, place[parents]))


def smoothed(tree: Tree) -> Tree:
    """Voxel steps evened out along the tree; ends stay."""
    if len(tree.points_mm) < 3:
        return tree
    mixing = _mixing(tree)
    is_end = np.diff(mixing.indptr) <= 2  # itself and one neighbour
    points = tree.points_mm
    for _ in range(3):
        points = np.where(is_end[:, None], points, mixing @ points)
    return Tree(points, tree.radii_mm, tree.parents)


def _mixing(tree: Tree) -> csr_array:
    """Matrix that moves a value at each point halfway to the mean of its neighbours."""
    count = len(tree.points_mm)
    parent, child = tree.edges.T
    graph = coo_array((np.ones(len(parent)), (parent, child)), shape=(count, count)).tocsr()
    both = csr_array(graph + graph.T)
    share = diags_array(1.0 / np.maximum(np.diff(both.indptr), 1))
    return csr_array(0.5 * (eye_array(count) + share @ both))


def centred(trees: Sequence[Tree], mask: NDArray[np.bool_], grid: Grid) -> list[Tree]:
    """The trees in the middle of the mask, with radii from its cross-section around each point.

    Each voxel belongs to the nearest point; volume, length and offset are evened out along the tree before
    they are divided. Voxels beyond an end of the line are left out, since no length belongs to them.
    """
    if not trees:
        return []
    voxels = grid.points_from_indices(np.argwhere(mask))
    points = np.concatenate([tree.points_mm for tree in trees])
    outward = np.concatenate([_outward_at_ends(tree) for tree in trees])
    _, nearest = cKDTree(points).query(voxels)
    away = voxels - points[nearest]
    beyond = np.einsum("ij,ij->i", away, outward[nearest])
    beside, away = nearest[beyond <= 0.0], (away - beyond[:, None] * outward[nearest])[beyond <= 0.0]
    counts = np.bincount(beside, minlength=len(points)).astype(np.float64)
    offsets = np.zeros_like(points)
    np.add.at(offsets, beside, away)
    made, start = [], 0
    for tree in trees:
        own = slice(start, start + len(tree.points_mm))
        start = own.stop
        mixing, count, length, offset = _mixing(tree), counts[own], _own_lengths(tree), offsets[own]
        for _ in range(6):
            count, length, offset = mixing.T @ count, mixing.T @ length, mixing.T @ offset
        area = count * grid.voxel_volume_mm3 / np.maximum(length, 1e-9)
        # Where branches share a wide place, each has a part of its section only, but the ball inside stays.
        radii = np.maximum(np.sqrt(area / np.pi), tree.radii_mm)
        made.append(Tree(tree.points_mm + offset / np.maximum(count, 1e-9)[:, None], radii, tree.parents))
    return made


def _outward_at_ends(tree: Tree) -> FloatArray:
    """Unit direction in which the tube goes on beyond each end of the tree; zero at inner points, (n, 3)."""
    outward = np.zeros_like(tree.points_mm)
    parent, child = tree.edges.T
    degree = np.bincount(tree.edges.ravel(), minlength=len(outward))
    for end, inner in ((child, parent), (parent, child)):
        is_end = degree[end] == 1
        outward[end[is_end]] = tree.points_mm[end[is_end]] - tree.points_mm[inner[is_end]]
    lengths = np.linalg.norm(outward, axis=1, keepdims=True)
    return outward / np.where(lengths > 0.0, lengths, 1.0)


def _own_lengths(tree: Tree) -> FloatArray:
    """Half of the edges that meet in each point, mm (n,)."""
    parent, child = tree.edges.T
    half = 0.5 * np.linalg.norm(tree.points_mm[child] - tree.points_mm[parent], axis=1)
    return np.bincount(tree.edges.T.ravel(), np.tile(half, 2), minlength=len(tree.points_mm)).astype(np.float64)


def path_from(tree: Tree, near_mm: Sequence[float] | FloatArray) -> FloatArray:
    """Points (n, 3) of the longest path, starting at the end that lies nearer to `near_mm`."""
    points = tree.points_mm[longest_path(tree)]
    first, last = (float(np.linalg.norm(points[n] - np.asarray(near_mm))) for n in (0, -1))
    return points if first <= last else points[::-1]
