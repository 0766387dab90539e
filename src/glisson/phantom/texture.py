"""Patterns in space that give a surface something to recognise."""

import numpy as np
from scipy.ndimage import map_coordinates

from glisson.core.arrays import FloatArray

_SIZE = 32


class Mottle:
    """Smooth random numbers in 0 to 1 through space (Perlin 1985's lattice noise), summed over several finenesses.

    Args:
        coarse_mm: size of the largest spots.
        levels: each half as large as the one before.
        seed: of the pattern.
    """

    def __init__(self, coarse_mm: float, levels: int, seed: int) -> None:
        rng = np.random.default_rng([seed, 77])
        self._lattices = rng.uniform(0.0, 1.0, (levels, _SIZE, _SIZE, _SIZE))
        self._coarse_mm = coarse_mm

    def at(self, points_mm: FloatArray) -> FloatArray:
        """Values (n,) at points (n, 3)."""
        total = np.zeros(len(points_mm))
        for level, lattice in enumerate(self._lattices):
            places = (points_mm * (2.0**level / self._coarse_mm)) % _SIZE
            total += map_coordinates(lattice, places.T, order=1, mode="grid-wrap")
        mean: FloatArray = total / len(self._lattices)
        return mean
