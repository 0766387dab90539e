"""Masks of shapes with known answers, for the tests of `glisson.preoperative`."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from glisson.core import Grid, LabelMap

Inside = Callable[[NDArray[np.float64]], NDArray[np.bool_]]


def mask_of(inside: Inside, grid: Grid) -> NDArray[np.bool_]:
    """Voxels whose centre (LPS mm) lies inside."""
    indices = np.moveaxis(np.indices(grid.shape), 0, -1).reshape(-1, 3)
    return inside(grid.points_from_indices(indices)).reshape(grid.shape)


def labels_of(name: str, inside: Inside, grid: Grid) -> LabelMap:
    return LabelMap(mask_of(inside, grid).astype(np.uint8), grid, {1: name})


def ellipsoid(centre: tuple[float, float, float], radii: tuple[float, float, float]) -> Inside:
    return lambda points: (((points - centre) / radii) ** 2).sum(axis=1) < 1.0


def two_lobes(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """A liver-like body on the plane y = 20: thick on the right (x < 0), a thin left lobe up to x = 80."""
    right = ellipsoid((-30.0, 0.0, 0.0), (50.0, 40.0, 45.0))(points)
    left = ellipsoid((25.0, 8.0, 5.0), (56.0, 22.0, 32.0))(points)
    return (right | left) & (points[:, 1] < 20.0)


LIVER_GRID = Grid((60, 30, 36), [3.0, 3.0, 3.0], [-88.0, -45.0, -52.0])


def dice(a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float:
    return float(2.0 * (a & b).sum() / (a.sum() + b.sum()))
