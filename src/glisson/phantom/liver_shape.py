"""The organ's shape as an implicit function: lobes, flat underside, hilum, gallbladder bed, caval groove."""

from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core.arrays import FloatArray
from glisson.phantom.implicit import (
    Points,
    Solid,
    cone,
    difference,
    ellipsoid,
    grown,
    half_space,
    intersection,
    union,
)
from glisson.phantom.proportions import Proportions


@dataclass(frozen=True, eq=False)
class LiverShape:
    """The liver with the neighbours that lie in its hollows (organ coordinates, mm).

    `portal_trunk` is the portal vein before it enters.
    """

    liver: Solid
    gallbladder: Solid
    cava: Solid
    portal_trunk: Solid


def build_shape(proportions: Proportions) -> LiverShape:
    """The shape of one member of the family."""
    place = proportions.place
    gallbladder = union(
        [
            cone(place([-17.0, -1.0, -20.0]), place([-26.0, 0.0, -42.0]), 4.0, 10.0),
            cone(place([-26.0, 0.0, -42.0]), place([-33.0, 0.0, -66.0]), 10.0, 13.0),
        ],
        blend=6.0,
    )
    cava = union(
        [
            cone(place([-14.0, 17.0, -115.0]), place([-14.0, 14.0, -12.0]), 10.0, 11.0),
            cone(place([-14.0, 14.0, -12.0]), place([-13.0, -4.0, 16.0]), 11.0, 11.0),
            cone(place([-13.0, -4.0, 16.0]), place([-12.0, -6.0, 115.0]), 11.0, 12.0),
        ],
        blend=5.0,
    )
    trunk = union(
        [
            cone(place([-9.0, -6.0, -9.0]), place([0.0, 8.0, -24.0]), 6.0, 6.5),
            cone(place([0.0, 8.0, -24.0]), place([12.0, 8.0, -75.0]), 6.5, 7.0),
        ],
        blend=4.0,
    )
    hilum = cone(place([-25.0, 2.0, -10.0]), place([4.0, 2.0, -12.0]), 9.0, 8.0)
    fissure = cone(place([6.0, 2.0, -14.0]), place([15.0, 0.0, -56.0]), 5.0, 10.0)
    # Only the upper part of the vena cava has a groove: below, the organ ends before it.
    groove = intersection(grown(cava, 0.8), half_space(2, float(place([0.0, 0.0, 12.0])[2]), keep_below=False), 6.0)
    body = _undulating(_lobes(proportions), proportions)
    body = intersection(body, half_space(1, 0.0, keep_below=True), blend=7.0)
    hollows = [(hilum, 6.0), (fissure, 6.0), (grown(gallbladder, 0.8), 4.0), (groove, 4.0)]
    liver = reduce(lambda solid, hollow: difference(solid, *hollow), hollows, body)
    return LiverShape(liver, gallbladder, cava, trunk)


def _lobes(proportions: Proportions) -> Solid:
    """Right lobe, bridge (quadrate region) and left lobe, before the underside is cut flat."""
    stretch = np.array([proportions.right, proportions.thick, proportions.tall])
    left_stretch = np.array([proportions.left, proportions.thick, proportions.tall])

    def lobe(row: int, centre: ArrayLike, radii: ArrayLike, stretched: FloatArray, turn: FloatArray) -> Solid:
        semi = np.asarray(radii, dtype=np.float64) * stretched * proportions.lobes[row]
        return ellipsoid(proportions.place(centre), semi, turn)

    right = lobe(0, [-57.0, -25.0, 0.0], [77.0, 50.0, 77.0], stretch, _turn(0, 10.0) @ _turn(1, -14.0))
    bridge = lobe(1, [-8.0, -14.0, 6.0], [52.0, 38.0, 58.0], stretch, _turn(0, 10.0))
    left = lobe(2, [32.0, -6.0, 19.0], [62.0, 34.0, 43.0], left_stretch, _turn(2, 9.0) @ _turn(1, -16.0))
    return union([union([right, bridge], blend=30.0), left], blend=26.0)


def _turn(axis: int, degrees: float) -> FloatArray:
    """Rotation matrix about a coordinate axis by the right-hand rule."""
    angle = np.deg2rad(degrees)
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i] = matrix[j, j] = np.cos(angle)
    matrix[i, j], matrix[j, i] = -np.sin(angle), np.sin(angle)
    return matrix


def _undulating(solid: Solid, proportions: Proportions) -> Solid:
    """The solid with gentle seeded bumps, which fade out towards the underside to keep it flat."""

    def distance(points: Points) -> NDArray[Any]:
        phase = points @ proportions.waves.T.astype(points.dtype) + proportions.phases.astype(points.dtype)
        fade = np.clip(points[..., 1] / -20.0, 0.0, 1.0)
        value: NDArray[Any] = solid.distance(points) + proportions.bump_mm * fade * np.cos(phase).sum(axis=-1)
        return value

    room = 6.0 * proportions.bump_mm
    return Solid(distance, solid.bounds + np.array([[-room], [room]]))
