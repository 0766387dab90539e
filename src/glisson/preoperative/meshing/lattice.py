"""Tetrahedra inside a level set, cut from a body-centred cubic lattice.

Lattice nodes that the surface passes closely are first moved onto it, so that no cut leaves a sliver
(after Labelle and Shewchuk 2007, "Isosurface stuffing", ACM Trans. Graph. 26(3):57); what remains of the
cut elements is split by one rule on both sides of a face, lowest node number first.
"""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, signed_volumes

_SNAP = 0.3
"""A node moves onto the surface when an edge is cut within this fraction of its length from it."""


def body_centred_lattice(low: FloatArray, high: FloatArray, spacing: float) -> tuple[FloatArray, IntArray]:
    """Nodes (n, 3) and tetrahedra (m, 4) of a lattice that covers the box from `low` to `high` with a margin.

    Each tetrahedron joins the centres of two neighbouring cubes with an edge of the face between them.
    """
    count = np.ceil((high - low) / spacing).astype(int) + 3
    origin = 0.5 * (low + high) - 0.5 * spacing * (count - 1)
    corners, centres = (np.indices(tuple(map(int, n))).reshape(3, -1).T for n in (count, count - 1))
    nodes = origin + spacing * np.concatenate([corners, centres + 0.5])
    corner = np.arange(len(corners)).reshape(count)
    centre = len(corners) + np.arange(len(centres)).reshape(count - 1)
    return nodes, np.concatenate([_around_faces(corner, centre, axis) for axis in range(3)])


def _around_faces(corner: IntArray, centre: IntArray, axis: int) -> IntArray:
    """The four tetrahedra at each inner cube face across one axis."""
    corner, centre = np.moveaxis(corner, axis, 0)[1:-1], np.moveaxis(centre, axis, 0)
    ring = [corner[:, :-1, :-1], corner[:, 1:, :-1], corner[:, 1:, 1:], corner[:, :-1, 1:]]
    below, above = centre[:-1], centre[1:]
    made = [np.stack([below, above, ring[n], ring[(n + 1) % 4]], axis=-1).reshape(-1, 4) for n in range(4)]
    return np.concatenate(made)


def inside_of_level(nodes: FloatArray, tetrahedra: IntArray, level: FloatArray) -> tuple[FloatArray, IntArray]:
    """The part of a mesh where the piecewise linear `level` (n,) is negative: nodes, positive tetrahedra.

    Nodes that are not used remain in the list.
    """
    tetrahedra = tetrahedra[(level[tetrahedra] < 0.0).any(axis=1)]
    nodes, level = _snapped(nodes, tetrahedra, level)
    negative, positive = (level[tetrahedra] < 0.0).sum(axis=1), (level[tetrahedra] > 0.0).sum(axis=1)
    whole = tetrahedra[(positive == 0) & (negative > 0)]
    cut = tetrahedra[(positive > 0) & (negative > 0)]
    cut = np.take_along_axis(cut, np.argsort(np.sign(level[cut]), axis=1, kind="stable"), axis=1)
    edges, crossings = _crossings(nodes, cut, level)
    pieces = _pieces(cut, np.sign(level[cut]).astype(int), edges, len(nodes))
    nodes, tetrahedra = np.concatenate([nodes, crossings]), np.concatenate([whole, *pieces])
    turned = signed_volumes(nodes, tetrahedra) < 0.0
    tetrahedra[turned] = tetrahedra[turned][:, [0, 2, 1, 3]]
    return nodes, tetrahedra


def _cut_edges(tetrahedra: IntArray, level: FloatArray) -> IntArray:
    """Edges (k, 2), lower node first and sorted, whose ends lie strictly on both sides."""
    edges = np.sort(tetrahedra[:, TET_EDGES].reshape(-1, 2), axis=1)
    return np.asarray(np.unique(edges[level[edges[:, 0]] * level[edges[:, 1]] < 0.0], axis=0))


def _crossings(nodes: FloatArray, tetrahedra: IntArray, level: FloatArray) -> tuple[IntArray, FloatArray]:
    edges = _cut_edges(tetrahedra, level)
    first, second = level[edges[:, 0]], level[edges[:, 1]]
    share = (first / (first - second))[:, None]
    return edges, (1.0 - share) * nodes[edges[:, 0]] + share * nodes[edges[:, 1]]


def _snapped(nodes: FloatArray, tetrahedra: IntArray, level: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Nodes beside the surface moved to the nearest crossing of their edges, relative to the edges' lengths."""
    edges, crossings = _crossings(nodes, tetrahedra, level)
    share = level[edges] / (level[edges] - level[edges[:, ::-1]])
    candidates, shares = edges.T.ravel(), share.T.ravel()
    order = np.argsort(shares, kind="stable")
    order = order[shares[order] < _SNAP]
    moved, first = np.unique(candidates[order], return_index=True)
    nodes, level = nodes.copy(), level.copy()
    nodes[moved] = np.tile(crossings, (2, 1))[order[first]]
    level[moved] = 0.0
    return nodes, level


def _pieces(cut: IntArray, signs: IntArray, edges: IntArray, first_number: int) -> list[IntArray]:
    """What remains of cut tetrahedra, whose corners are sorted: inside, on the surface, outside."""
    keys = edges[:, 0] * first_number + edges[:, 1]

    def crossing(a: IntArray, b: IntArray) -> IntArray:
        key = np.minimum(a, b) * first_number + np.maximum(a, b)
        return np.asarray(first_number + np.searchsorted(keys, key))

    inside = (signs < 0).sum(axis=1)
    outside = (signs > 0).sum(axis=1)

    def corners(n_inside: int, n_outside: int) -> IntArray:
        return np.ascontiguousarray(cut[(inside == n_inside) & (outside == n_outside)].T)

    a, b, c, d = corners(1, 3)
    made = [np.stack([a, crossing(a, b), crossing(a, c), crossing(a, d)], axis=1)]
    a, b, c, d = corners(1, 2)
    made.append(np.stack([a, b, crossing(a, c), crossing(a, d)], axis=1))
    a, b, c, d = corners(1, 1)
    made.append(np.stack([a, b, c, crossing(a, d)], axis=1))
    a, b, c, d = corners(2, 2)
    made.append(_prisms([a, crossing(a, c), crossing(a, d)], [b, crossing(b, c), crossing(b, d)]))
    a, b, c, d = corners(3, 1)
    made.append(_prisms([a, b, c], [crossing(a, d), crossing(b, d), crossing(c, d)]))
    a, b, c, d = corners(2, 1)
    made.append(_pyramids(c, [a, b, crossing(b, d), crossing(a, d)]))
    return made


def _prisms(bottom: list[IntArray], top: list[IntArray]) -> IntArray:
    """Prisms with edges bottom[i] – top[i], three tetrahedra each."""
    six = np.stack(bottom + top, axis=1)
    lowest = six.argmin(axis=1)
    upside = lowest >= 3
    six[upside] = six[upside][:, [3, 4, 5, 0, 1, 2]]
    turn = (np.arange(3) + (lowest % 3)[:, None]) % 3
    a, b, c, d, e, f = np.take_along_axis(six, np.concatenate([turn, turn + 3], axis=1), axis=1).T
    # Both side faces at the lowest corner are split through it; the third by its own lowest corner.
    return np.concatenate([np.stack([a, d, e, f], axis=1), _pyramids(a, [b, c, f, e])])


def _pyramids(apex: IntArray, ring: list[IntArray]) -> IntArray:
    """Pyramids over a four-sided base, two tetrahedra each."""
    a, b, c, d = ring
    through_a: NDArray[np.bool_] = np.minimum(a, c) < np.minimum(b, d)
    first = np.where(through_a, [apex, a, b, c], [apex, b, c, d])
    second = np.where(through_a, [apex, a, c, d], [apex, b, d, a])
    return np.concatenate([first.T, second.T])
