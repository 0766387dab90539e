"""The dissertation's construction (section 5.3) for many sets of measurements at once.

Its slips are corrected: H′ is the principal point after undistortion, C the centre of projection, and
P = H + ξ R(S′ − H′).
"""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Measured:
    """What the construction goes by; "..." may be any number of sets.

    Args:
        centres_mm: C, (..., 2, 3), of the two views.
        forward: n, unit, (..., 2, 3).
        touched_mm: T, (..., 3).
        tips: T′ − H′, (..., 2, 2) in undistorted px.
        points: S′ − H′, (..., 2, m, 2) in undistorted px.
    """

    centres_mm: FloatArray
    forward: FloatArray
    touched_mm: FloatArray
    tips: FloatArray
    points: FloatArray


def lines(measured: Measured) -> FloatArray:
    """Unit directions (..., 2, m, 3) from C through P of every point.

    The scale ξ and the roll that takes H′T′ to HT are the size and the angle of one complex number.
    """
    forward = measured.forward
    first, second = _across(forward)
    arm = measured.touched_mm[..., None, :] - measured.centres_mm
    depth = (arm * forward).sum(axis=-1)
    in_plane = (arm * first).sum(axis=-1) + 1j * (arm * second).sum(axis=-1)
    turned = in_plane / (measured.tips[..., 0] + 1j * measured.tips[..., 1])
    places = turned[..., None] * (measured.points[..., 0] + 1j * measured.points[..., 1])
    reach = (
        depth[..., None, None] * forward[..., None, :]
        + places.real[..., None] * first[..., None, :]
        + places.imag[..., None] * second[..., None, :]
    )
    unit: FloatArray = reach / np.linalg.norm(reach, axis=-1, keepdims=True)
    return unit


def nearest_points(centres_mm: FloatArray, directions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Midpoints (..., m, 3) of the common perpendiculars of two lines, and the gaps (..., m, 3) that these span."""
    start, end = centres_mm[..., 0, None, :], centres_mm[..., 1, None, :]
    one, two = directions[..., 0, :, :], directions[..., 1, :, :]
    between = end - start
    cosine = (one * two).sum(axis=-1)
    square = np.maximum(1.0 - cosine**2, 1e-15)
    along_one, along_two = (one * between).sum(axis=-1), (two * between).sum(axis=-1)
    first = start + ((along_one - cosine * along_two) / square)[..., None] * one
    second = end + ((cosine * along_one - along_two) / square)[..., None] * two
    return 0.5 * (first + second), second - first


def _across(forward: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors e₁, e₂ across n with e₁ × e₂ = n, as the image's u, v and the view's direction are."""
    axis = np.where(np.abs(forward[..., :1]) < 0.7, np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0]))
    first = axis - (axis * forward).sum(axis=-1, keepdims=True) * forward
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    return first, np.cross(forward, first)
