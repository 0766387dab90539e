"""CT noise: Gaussian, with the spectrum of filtered back-projection instead of a white one.

A ramp filter with a soft cut-off leaves little noise at low frequencies: neighbouring voxels correlate
positively, voxels a few mm apart negatively. A difference of two Gaussians has that shape.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from glisson.core.image import Grid

_FINE_MM, _COARSE_MM = 0.75, 2.2


def ct_noise(grid: Grid, sigma_hu: float, seed: int) -> NDArray[np.float32]:
    """Noise [i, j, k] in HU with standard deviation `sigma_hu`, correlated over about 2 mm in the slice."""
    random = np.random.default_rng([seed, 2])
    white = random.standard_normal(grid.shape, dtype=np.float32)
    # Slices are reconstructed one by one: hardly any correlation along the last axis.
    fine = gaussian_filter(white, [*(_FINE_MM / grid.spacing_mm[:2]), 0.4])
    coarse = gaussian_filter(white, [*(_COARSE_MM / grid.spacing_mm[:2]), 0.4])
    noise: NDArray[np.float32] = fine - 0.85 * coarse
    noise *= np.float32(sigma_hu / float(noise.std()))
    return noise
