"""Exact volumes of tetrahedra cut by a plane."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import signed_volumes
from glisson.core.structures import Plane


def volume_beyond(nodes: FloatArray, corners: IntArray, plane: Plane) -> FloatArray:
    """Volume (m,) in mm³ of each straight tetrahedron (m, 4) on the removed side of a plane.

    The part of a tetrahedron where a linear function is positive has a closed form in its four corner
    values; every term below is a product of numbers in [0, 1], so nothing cancels.
    """
    return signed_volumes(nodes, corners) * fraction_beyond(plane.distance_mm(nodes)[corners])


def fraction_beyond(distances: FloatArray) -> FloatArray:
    """Fraction (m,) of each tetrahedron where the linear function with corner values (m, 4) is positive."""
    ordered = -np.sort(-distances, axis=1)
    positive = (ordered > 0.0).sum(axis=1)
    fraction = np.where(positive == 4, 1.0, 0.0)
    for count, part in ((1, _one_corner), (2, _two_corners), (3, _three_corners)):
        rows = np.flatnonzero(positive == count)
        fraction[rows] = part(ordered[rows])
    return fraction


def _share(positive: FloatArray, negative: FloatArray) -> FloatArray:
    """Part of an edge on the positive side, given the values at its positive and its other end."""
    return positive / (positive - negative)


def _one_corner(d: FloatArray) -> FloatArray:
    a = d[:, 0]
    return _share(a, d[:, 1]) * _share(a, d[:, 2]) * _share(a, d[:, 3])


def _three_corners(d: FloatArray) -> FloatArray:
    return 1.0 - _one_corner(-d[:, ::-1])


def _two_corners(d: FloatArray) -> FloatArray:
    """The wedge between corners p, q (positive) and the four cut edges to r, s, as three tetrahedra."""
    pr, ps = _share(d[:, 0], d[:, 2]), _share(d[:, 0], d[:, 3])
    qr, qs = _share(d[:, 1], d[:, 2]), _share(d[:, 1], d[:, 3])
    return pr * ps + ps * qr * (1.0 - pr) + qr * qs * (1.0 - ps)
