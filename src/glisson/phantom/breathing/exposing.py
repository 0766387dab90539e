"""When a sensor's rows see: exposure, and the time from the first row to the last."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray


@dataclass(frozen=True)
class Shutter:
    """Frames per second, how long each row is exposed, and how much later the last row begins than the first (s)."""

    frames_per_s: float = 60.0
    exposure_s: float = 0.008
    readout_s: float = 0.010

    def begins(self, frame: ArrayLike, row: ArrayLike, height: int) -> FloatArray:
        """When the exposure of a row of a frame begins (s)."""
        return np.asarray(np.asarray(frame) / self.frames_per_s + self.readout_s * np.asarray(row) / height)

    def middles(self, frame_count: int, height: int) -> FloatArray:
        """The middle of the exposure of the middle row of each frame (s)."""
        return self.begins(np.arange(frame_count), 0.5 * (height - 1), height) + 0.5 * self.exposure_s

    def moments(self, count: int) -> FloatArray:
        """So many moments spread evenly over an exposure, from its beginning (s)."""
        return (np.arange(count) + 0.5) / count * self.exposure_s
