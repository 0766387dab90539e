"""What lies inside the organ and moves with it: tumours, vessels, duct, wire, planes (LPS mm)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import (
    FloatArray,
    IntArray,
    check_range,
    frozen_floats,
    frozen_ints,
    unit_vector,
)
from glisson.core.errors import BadInput
from glisson.core.mesh import TriangleSurface


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane through `point_mm`; `normal` is a unit vector towards the side that is removed."""

    point_mm: FloatArray
    normal: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "point_mm", frozen_floats(self.point_mm, (3,), "plane point"))
        object.__setattr__(self, "normal", unit_vector(self.normal, "plane normal"))

    def distance_mm(self, points_mm: ArrayLike) -> FloatArray:
        """Signed distance of points (n, 3); positive on the removed side."""
        result: FloatArray = (np.asarray(points_mm, dtype=np.float64) - self.point_mm) @ self.normal
        return result


@dataclass(frozen=True, eq=False)
class Curve:
    """A polyline of at least two points (n, 3) in mm, in order. The first point is the duct's mouth."""

    points_mm: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_mm", frozen_floats(self.points_mm, (None, 3), "curve points"))
        if len(self.points_mm) < 2 or self.length_mm == 0.0:
            raise BadInput("A curve needs two different points at least.")

    @property
    def arc_lengths_mm(self) -> FloatArray:
        """Arc length from the first point to each point, (n,)."""
        steps = np.linalg.norm(np.diff(self.points_mm, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length_mm(self) -> float:
        """Whole length."""
        return float(self.arc_lengths_mm[-1])


@dataclass(frozen=True, eq=False)
class VesselTree:
    """A vessel tree: centreline points (n, 3) mm, radii (n,) mm, edges (e, 2) parent → child; root is 0."""

    name: str
    points_mm: FloatArray
    radii_mm: FloatArray
    edges: IntArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "points_mm", frozen_floats(self.points_mm, (None, 3), "vessel points"))
        count = len(self.points_mm)
        object.__setattr__(self, "radii_mm", frozen_floats(self.radii_mm, (count,), "vessel radii"))
        object.__setattr__(self, "edges", frozen_ints(self.edges, (None, 2), "vessel edges"))
        check_range(self.edges, count, "A vessel edge")

    @property
    def length_mm(self) -> float:
        """Length of all edges together."""
        ends = self.points_mm[self.edges]
        return float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())


@dataclass(frozen=True, eq=False)
class Tumour:
    """A tumour as a closed surface; its centroid is that of the enclosed volume."""

    name: str
    surface: TriangleSurface

    @property
    def volume_mm3(self) -> float:
        """Enclosed volume."""
        return self.surface.volume_mm3

    @property
    def centroid_mm(self) -> FloatArray:
        """Centroid (3,) of the enclosed volume."""
        corners = self.surface.vertices[self.surface.triangles]
        weights = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
        # Each triangle and the origin span a signed tetrahedron whose centroid is the sum of corners / 4.
        centroid: FloatArray = weights @ corners.sum(axis=1) / 4.0 / weights.sum()
        return centroid


@dataclass(frozen=True, eq=False)
class Structures:
    """Everything embedded in the organ. `duct` is the bile duct's centreline from its mouth inward.

    The wire of fixed length lies in the duct; `wire_length_mm` of it are inside, measured from the mouth. `curves` are
    other lines by name that can be seen during surgery, such as the falciform ligament's on the surface.
    """

    tumours: tuple[Tumour, ...] = ()
    trees: tuple[VesselTree, ...] = ()
    duct: Curve | None = None
    wire_length_mm: float | None = None
    curves: Mapping[str, Curve] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "curves", MappingProxyType(dict(self.curves)))
        names = [tumour.name for tumour in self.tumours] + [tree.name for tree in self.trees] + list(self.curves)
        if len(set(names)) != len(names):
            raise BadInput(f"Tumours, vessel trees and curves need different names, not {names}.")
        if (self.wire_length_mm is None) != (self.duct is None):
            raise BadInput("A wire needs a duct to lie in, and a duct a wire length (the whole duct if unknown).")
