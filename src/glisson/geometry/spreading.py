"""Few points out of many that are spread evenly."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray


def evenly_spread(points_mm: FloatArray, count: int) -> IntArray:
    """Numbers of up to `count` of the points (n, 3), each as far from those before as can be; the first is 0."""
    chosen = [0]
    nearest = np.linalg.norm(points_mm - points_mm[0], axis=1)
    while len(chosen) < min(count, len(points_mm)):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(points_mm - points_mm[chosen[-1]], axis=1))
    return np.array(chosen, dtype=np.int64)
