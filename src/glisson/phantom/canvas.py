"""Painting solids into voxels with partial volumes, and telling which voxel centres lie inside.

The part of a voxel that a solid covers is taken as 1/2 − d/w, d being the distance of the voxel's centre
from the surface and w the voxel's mean width: exact for a plane face seen along an axis.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.image import Grid
from glisson.core.structures import VesselTree
from glisson.phantom.implicit import Solid, cone

Box = tuple[slice, slice, slice]
"""A block of voxels."""

_FAR_MM = 1e3


class Canvas:
    """Voxels [i, j, k] to paint on: `hu` in place, `places` (i, j, k, 3) the coordinates solids are given in.

    `places` may differ from the voxels' own coordinates by up to `margin_mm` (a loaded organ painted from
    its rest shape).
    """

    def __init__(self, grid: Grid, hu: NDArray[np.float32], places: NDArray[np.float32], margin_mm: float) -> None:
        self.grid = grid
        self.hu = hu
        self.places = places
        self._margin = margin_mm + 1.5 * float(grid.spacing_mm.max())
        self._width = float(grid.spacing_mm.mean())

    def box(self, bounds: FloatArray) -> Box:
        """The block of voxels that can be touched by a solid with these bounds (2, 3)."""
        low, high = bounds[0] - self._margin, bounds[1] + self._margin
        corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
        index = self.grid.indices_from_points(corners)
        shape = np.array(self.grid.shape)
        first = np.clip(np.floor(index.min(axis=0)).astype(int), 0, shape)
        last = np.clip(np.ceil(index.max(axis=0)).astype(int) + 1, 0, shape)
        return slice(first[0], last[0]), slice(first[1], last[1]), slice(first[2], last[2])

    def distance(self, solid: Solid) -> tuple[Box, NDArray[Any]]:
        """A solid's distance (mm) at the voxel centres of its box."""
        box = self.box(solid.bounds)
        return box, solid.distance(self.places[box])

    def paint(self, solid: Solid, hu: float) -> NDArray[np.bool_]:
        """Mix a solid into the picture; returns the mask [i, j, k] of voxel centres inside it."""
        box, distance = self.distance(solid)
        return self.mix(box, distance, hu)

    def mix(self, box: Box, distance: NDArray[Any], hu: float, strength: float = 1.0) -> NDArray[np.bool_]:
        """Mix a distance field over a box into the picture; returns the mask of voxel centres inside.

        `strength` below one weakens what is thinner than a voxel.
        """
        cover = strength * np.clip(0.5 - distance / self._width, 0.0, 1.0)
        self.hu[box] += cover * (hu - self.hu[box])
        mask = np.zeros(self.grid.shape, dtype=bool)
        mask[box] = distance < 0.0
        return mask

    def paint_tube(self, points: FloatArray, radius_mm: float, hu: float) -> NDArray[np.bool_]:
        """Mix a tube of constant radius along points (n, 3) into the picture; returns its mask.

        A tube thinner than a voxel covers π r² / w² of it at most.
        """
        count = len(points)
        edges = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
        tree = VesselTree("tube", points, np.full(count, radius_mm), edges)
        strength = min(1.0, np.pi * radius_mm**2 / self._width**2)
        return self.mix(self._everything(), self.tree_distance(tree), hu, strength)

    def paint_tree(self, tree: VesselTree, hu: float) -> NDArray[np.bool_]:
        """Mix a vessel tree into the picture; returns its mask."""
        return self.mix(self._everything(), self.tree_distance(tree), hu)

    def tree_distance(self, tree: VesselTree) -> NDArray[np.float32]:
        """Distance (mm) [i, j, k] from the wall of a tree, far away a large number."""
        distance = np.full(self.grid.shape, _FAR_MM, dtype=np.float32)
        for parent, child in tree.edges:
            start, end = tree.points_mm[parent], tree.points_mm[child]
            box, own = self.distance(cone(start, end, float(tree.radii_mm[parent]), float(tree.radii_mm[child])))
            np.minimum(distance[box], own, out=distance[box])
        return distance

    def _everything(self) -> Box:
        return slice(None), slice(None), slice(None)


def voxel_places(grid: Grid) -> NDArray[np.float32]:
    """LPS coordinates (i, j, k, 3) of all voxel centres, mm."""
    affine = grid.lps_from_index.astype(np.float32)
    i, j, k = (np.arange(n, dtype=np.float32)[:, None] * affine[:3, axis] for axis, n in enumerate(grid.shape))
    places: NDArray[np.float32] = (i[:, None, None] + j[None, :, None]) + (k + affine[:3, 3])[None, None]
    return places


def sub_grid(grid: Grid, box: Box) -> Grid:
    """The grid of a block of voxels."""
    first = np.array([side.start for side in box], dtype=np.float64)
    shape = (box[0].stop - box[0].start, box[1].stop - box[1].start, box[2].stop - box[2].start)
    return Grid(shape, grid.spacing_mm, grid.points_from_indices(first[None])[0], grid.direction)
