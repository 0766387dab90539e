"""What spoils a scan: streaks of metal and gas in CT, uneven coil sensitivity and noise in MR.

Metal hardens the beam and starves the detector: each ray's value is too low by about the square of the metal that
it met, and noisy. Gas that moves while the gantry turns makes the rays contradict each other. Both errors are made
on the rays of each slice (parallel beam) and reconstructed by filtered back-projection, as a scanner does.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, shift
from skimage.transform import iradon, radon

from glisson.core.arrays import FloatArray
from glisson.core.image import Grid
from glisson.geometry.distance_map import distance_inside

_ANGLES = 180
_NEAR_MM = 30.0
"""Streaks are as strong as asked for within this distance of their source."""

_STARVED = 0.4
"""Standard deviation of a ray's noise over its mean error."""

_GAS_MOVES_MM = 3.0
_BIAS_MM = 70.0


def streaks(
    metal: NDArray[np.bool_], gas: NDArray[np.bool_], grid: Grid, metal_sigma: float, gas_sigma: float, seed: int
) -> NDArray[np.float32]:
    """Streaks [i, j, k] in HU with these standard deviations near metal and gas."""
    random = np.random.default_rng([seed, 4])
    found = np.zeros(grid.shape, dtype=np.float32)
    for sigma, source, rays in ((metal_sigma, metal, _hardened), (gas_sigma, gas, _moving)):
        if sigma <= 0.0 or not source.any():
            continue
        made = np.zeros(grid.shape, dtype=np.float32)
        for k in np.flatnonzero(source.any(axis=(0, 1))):
            made[:, :, k] = _reconstructed(rays(source[:, :, k].astype(float), grid, random), grid.shape[:2])
        near = (distance_inside(~source, grid.spacing_mm) < _NEAR_MM) & ~source
        found += made * np.float32(sigma / max(float(made[near].std()), 1e-6))
    return found


def sensitivity(grid: Grid, deviation: float, seed: int) -> NDArray[np.float32]:
    """Sensitivity [i, j, k] of an MR coil: its logarithm has this standard deviation, over some 70 mm."""
    random = np.random.default_rng([seed, 5])
    rough = gaussian_filter(
        random.standard_normal(grid.shape, dtype=np.float32), _BIAS_MM / grid.spacing_mm, mode="reflect", truncate=3.0
    )
    rough -= rough.mean()
    even: NDArray[np.float32] = np.exp(rough * np.float32(deviation / float(rough.std())))
    return even


def rician(signal: NDArray[np.float32], sigma: float, seed: int) -> NDArray[np.float32]:
    """The magnitude of a signal with complex Gaussian noise (Gudbjartsson and Patz 1995)."""
    random = np.random.default_rng([seed, 2])
    real = signal + np.float32(sigma) * random.standard_normal(signal.shape, dtype=np.float32)
    imaginary = np.float32(sigma) * random.standard_normal(signal.shape, dtype=np.float32)
    magnitude: NDArray[np.float32] = np.hypot(real, imaginary)
    return magnitude


def _theta() -> FloatArray:
    return np.linspace(0.0, 180.0, _ANGLES, endpoint=False)


def _hardened(metal: FloatArray, grid: Grid, random: np.random.Generator) -> FloatArray:
    met: FloatArray = radon(metal, _theta(), circle=False)
    error = -(met**2)
    starved: FloatArray = error * (1.0 + _STARVED * random.standard_normal(error.shape))
    return starved


def _moving(gas: FloatArray, grid: Grid, random: np.random.Generator) -> FloatArray:
    """Rays of gas that has come some way when the last half of them is taken."""
    way = random.uniform(-_GAS_MOVES_MM, _GAS_MOVES_MM, size=2) / grid.spacing_mm[:2]
    before: FloatArray = radon(gas, _theta(), circle=False)
    after = radon(shift(gas, way, order=1), _theta(), circle=False)
    before[:, : _ANGLES // 2] = 0.0
    before[:, _ANGLES // 2 :] -= after[:, _ANGLES // 2 :]
    return before


def _reconstructed(rays: FloatArray, shape: Sequence[int]) -> FloatArray:
    whole = iradon(rays, _theta(), output_size=int(np.ceil(np.hypot(shape[0], shape[1]))), circle=False)
    # radon puts a picture into the middle of a square as wide as its diagonal.
    first = [(whole.shape[0] - n) // 2 for n in shape]
    part: FloatArray = whole[first[0] : first[0] + shape[0], first[1] : first[1] + shape[1]]
    return part
