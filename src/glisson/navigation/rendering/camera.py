"""The picture's point of view."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Camera:
    """A parallel projection: `right`, `up` and `forward` are unit vectors (3,), `centre` is seen in the middle.

    `mm_per_pixel` is the scale of a picture of `width` × `height` pixels.
    """

    centre: FloatArray
    right: FloatArray
    up: FloatArray
    forward: FloatArray
    mm_per_pixel: float
    width: int
    height: int

    def pixels(self, points: ArrayLike) -> FloatArray:
        """Pixel coordinates (n, 2) of points (n, 3) in mm: x to the right, y down, pixel centres at halves."""
        offset = (np.asarray(points, dtype=np.float64) - self.centre) / self.mm_per_pixel
        return np.stack([self.width / 2.0 + offset @ self.right, self.height / 2.0 - offset @ self.up], axis=-1)

    def window(self, points: FloatArray) -> tuple[slice, slice]:
        """Rows and columns of the smallest part of the picture that shows all points (n, 3)."""
        across, down = self.pixels(points).T
        rows = np.clip([np.floor(down.min()) - 1, np.ceil(down.max()) + 1], 0, self.height).astype(int)
        columns = np.clip([np.floor(across.min()) - 1, np.ceil(across.max()) + 1], 0, self.width).astype(int)
        return slice(int(rows[0]), int(rows[1])), slice(int(columns[0]), int(columns[1]))

    def rays(self, window: tuple[slice, slice], oversampling: int, distance_mm: float) -> FloatArray:
        """Origins (rows·k, columns·k, 3) of the rays of a window, `distance_mm` before the centre.

        All rays go `forward`; each pixel has `oversampling`² of them.
        """
        rows, columns = (
            (np.arange(part.start * oversampling, part.stop * oversampling) + 0.5) / oversampling for part in window
        )
        corner = self.centre - distance_mm * self.forward
        x = (columns - self.width / 2.0)[None, :, None] * self.mm_per_pixel * self.right
        y = (self.height / 2.0 - rows)[:, None, None] * self.mm_per_pixel * self.up
        origins: FloatArray = corner + x + y
        return origins


def framing(
    points: FloatArray, forward: ArrayLike, up: ArrayLike, size: tuple[int, int] = (900, 650), border: float = 0.06
) -> Camera:
    """A camera that looks `forward` and shows all `points` (n, 3) with a border (share of the picture)."""
    ahead = np.asarray(forward, dtype=np.float64) / np.linalg.norm(forward)
    right = np.cross(ahead, np.asarray(up, dtype=np.float64))
    right /= np.linalg.norm(right)
    upward = np.cross(right, ahead)
    across, along, depth = points @ right, points @ upward, points @ ahead
    width, height = size
    scale = max(np.ptp(across) / width, np.ptp(along) / height) / (1.0 - 2.0 * border)
    middles = [(float(line.min()) + float(line.max())) / 2.0 for line in (across, along, depth)]
    centre = middles[0] * right + middles[1] * upward + middles[2] * ahead
    return Camera(centre, right, upward, ahead, float(scale), width, height)
