"""The block of voxels about a place, and distances from it."""

import numpy as np

from glisson.core.arrays import FloatArray

Index = tuple[int, int, int]


def surroundings(
    shape: tuple[int, ...], spacing_mm: FloatArray, place: Index, reach_mm: float
) -> tuple[tuple[slice, ...], Index]:
    """The part of an array that lies within so many mm of a voxel along each axis, and the voxel's place in it."""
    reach = np.ceil(reach_mm / spacing_mm).astype(int) + 1
    low = np.maximum(np.array(place) - reach, 0)
    high = np.minimum(np.array(place) + reach + 1, shape)
    a, b, c = (np.array(place) - low).tolist()
    return tuple(slice(int(x), int(y)) for x, y in zip(low, high, strict=True)), (a, b, c)


def distance_from(place: Index, shape: tuple[int, ...], spacing_mm: FloatArray) -> FloatArray:
    """Distance (mm) of every voxel of a block from one of them."""
    axes = [((np.arange(n) - p) * s) ** 2 for n, p, s in zip(shape, place, spacing_mm, strict=True)]
    a, b, c = np.meshgrid(*axes, indexing="ij", sparse=True)
    distance: FloatArray = np.sqrt(a + b + c)
    return distance
