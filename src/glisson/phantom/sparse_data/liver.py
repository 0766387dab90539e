"""A liver of the twin: its scanned surface, the features a surgeon can name on it, and the targets inside."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TriangleSurface
from glisson.core.structures import Curve
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.normals import vertex_normals
from glisson.geometry.spreading import evenly_spread
from glisson.phantom.implicit import Solid
from glisson.phantom.liver_shape import build_shape
from glisson.phantom.proportions import Proportions, draw_proportions
from glisson.phantom.solid_surface import solid_surface

TARGETS = 159
"""As many as in the challenge."""

FALCIFORM, LEFT_RIDGE, RIGHT_RIDGE = "falciform ridge", "left inferior ridge", "right inferior ridge"
FEATURES = (FALCIFORM, LEFT_RIDGE, RIGHT_RIDGE)
"""Curves on the surface that are swabbed apart, as in the challenge."""

_SURFACE_STEP_MM = 2.5
_TARGET_DEPTH_MM = 5.0
_CANDIDATES = 6000
_FALCIFORM_X_MM, _FALCIFORM_SLOPE = 11.0, -0.08
_FALCIFORM_WIDTH_MM = 2.0
_PIECE_MM = 5.0


@dataclass(frozen=True, eq=False)
class SparseLiver:
    """A member of the family in its scanned shape A (LPS mm).

    `features` are curves on the surface by name, from the notch between the lobes outward; `targets_mm` (159, 3) are
    material points spread through the inside.
    """

    member: int
    surface: TriangleSurface
    features: Mapping[str, Curve]
    targets_mm: FloatArray


@lru_cache(maxsize=4)
def build_sparse_liver(member: int) -> SparseLiver:
    """The liver of a member of the family; its procedural shape is taken as the scanned one."""
    proportions = draw_proportions(member)
    solid = build_shape(proportions).liver
    surface = solid_surface(solid, _SURFACE_STEP_MM)
    return SparseLiver(member, surface, _features(surface, proportions), _targets(solid, member))


def _targets(solid: Solid, member: int) -> FloatArray:
    random = np.random.default_rng([member, 41])
    drawn = random.uniform(solid.bounds[0], solid.bounds[1], size=(_CANDIDATES, 3))
    inside = drawn[solid.distance(drawn) < -_TARGET_DEPTH_MM]
    chosen: FloatArray = inside[evenly_spread(inside, TARGETS)]
    return chosen


def _features(surface: TriangleSurface, proportions: Proportions) -> dict[str, Curve]:
    """The falciform ligament's line in front, and the lower margin on either side of it."""
    points, normals = surface.vertices, vertex_normals(surface.vertices, surface.triangles)
    line = proportions.place([_FALCIFORM_X_MM, 0.0, 0.0])[0] + _FALCIFORM_SLOPE * points[:, 2]
    front = (normals[:, 1] < -0.3) & (np.abs(points[:, 0] - line) < _FALCIFORM_WIDTH_MM)
    margin = (np.abs(normals[:, 1]) < 0.12) & (normals[:, 2] < -0.35)
    left, right = margin & (points[:, 0] > line), margin & (points[:, 0] < line)
    tree = SurfaceTree(points, surface.triangles)
    return {
        FALCIFORM: _curve(points[front], points[front, 2], tree),
        LEFT_RIDGE: _curve(points[left], points[left, 0], tree),
        RIGHT_RIDGE: _curve(points[right], -points[right, 0], tree),
    }


def _curve(band: FloatArray, along: FloatArray, tree: SurfaceTree) -> Curve:
    """The line on the surface along the middle of a band of its points (n, 3), in the order of `along` (n,)."""
    _, piece = np.unique(np.floor(along / _PIECE_MM), return_inverse=True)
    middles = np.stack([np.bincount(piece, weights=band[:, axis]) / np.bincount(piece) for axis in range(3)], axis=1)
    return Curve(tree.nearest(middles).closest_mm)
