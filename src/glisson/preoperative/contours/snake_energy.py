"""What draws a snake on a slice: lines, edges, and the ends of lines (dissertation, equations 2.36 to 2.42).

With the image C, smoothed by a Gaussian of width σ and divided by a contrast c, the energy is

    w_line C − w_edge σ² |∇C|² + w_term σ (C_yy C_x² − 2 C_xy C_x C_y + C_xx C_y²) / |∇C|³

where x is along columns and y along rows, in mm. Print repeats C_xy in the last term and adds 1 to the root of the
denominator, which makes it depend on the unit of grey values; instead it fades where |∇C| is below noise. σ makes
all three plain numbers.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.interpolate import RectBivariateSpline

from glisson.core.arrays import FloatArray

_REACH = 6.0
"""Of the Gaussian, in σ: cut off nearer, its second derivative would also see the grey value itself."""


@dataclass(frozen=True)
class SnakeWeights:
    """`line` > 0 is drawn to dark lines and < 0 to bright ones, `edge` to edges, `termination` to the ends of lines.

    `contrast` is in grey values; gradients below `noise` (of the contrast in a width σ) have no direction.
    """

    line: float = 0.0
    edge: float = 1.0
    termination: float = 0.0
    sigma_mm: float = 1.5
    contrast: float = 50.0
    noise: float = 0.05


class SnakeEnergy:
    """The energy and its slope anywhere on a slice, by a cubic spline.

    Args:
        image: grey values (rows, columns).
        spacing_mm: of rows and columns (2,).
        weights: what draws.
    """

    def __init__(self, image: NDArray[np.floating], spacing_mm: FloatArray, weights: SnakeWeights) -> None:
        spacing = np.asarray(spacing_mm, dtype=np.float64)
        places = [np.arange(count) * step for count, step in zip(image.shape, spacing, strict=True)]
        self._last = np.array([axis[-1] for axis in places])
        self._spline = RectBivariateSpline(*places, _energy(image, spacing, weights))

    def at(self, points_mm: FloatArray) -> FloatArray:
        """Energy (n,) at points (n, 2) in mm along rows and columns from the first pixel's centre."""
        rows, columns = np.clip(points_mm, 0.0, self._last).T
        energy: FloatArray = self._spline.ev(rows, columns)
        return energy

    def force(self, points_mm: FloatArray) -> FloatArray:
        """Minus the slope (n, 2) in 1/mm; none beyond the slice's border."""
        rows, columns = np.clip(points_mm, 0.0, self._last).T
        slope = np.stack([self._spline.ev(rows, columns, dx=1), self._spline.ev(rows, columns, dy=1)], axis=1)
        inside = (points_mm >= 0.0) & (points_mm <= self._last)
        return np.where(inside, -slope, 0.0)


def _energy(image: NDArray[np.floating], spacing: FloatArray, weights: SnakeWeights) -> FloatArray:
    sigma, pixels = weights.sigma_mm, weights.sigma_mm / spacing
    scaled = image.astype(np.float64) / weights.contrast

    def derivative(rows: int, columns: int) -> FloatArray:
        unit = spacing[0] ** rows * spacing[1] ** columns
        found: FloatArray = ndimage.gaussian_filter(scaled, pixels, order=(rows, columns), truncate=_REACH) / unit
        return found

    smooth, by_y, by_x = derivative(0, 0), derivative(1, 0), derivative(0, 1)
    squared = by_x**2 + by_y**2
    energy = weights.line * smooth - weights.edge * sigma**2 * squared
    if weights.termination:
        bend = derivative(2, 0) * by_x**2 - 2.0 * derivative(1, 1) * by_x * by_y + derivative(0, 2) * by_y**2
        noise = (weights.noise / sigma) ** 2
        # Of third order in |∇C| above and below, and of none where the gradient drowns.
        energy += weights.termination * sigma * bend / np.maximum(squared, noise) ** 1.5 * (squared >= noise)
    return energy
