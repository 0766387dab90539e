"""What a sensor makes of the light that reaches it: blur, fall-off towards the corners, noise, eight bits."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from glisson.core.arrays import FloatArray


@dataclass(frozen=True)
class Sensor:
    """How a picture is taken.

    Args:
        blur_px: standard deviation of what a point of light becomes.
        noise: standard deviation in grey levels of 255 of what is added where it is dark.
        shot_noise: the same where it is white, beyond that.
        fall_off: share of the light that the corners lack.
    """

    blur_px: float = 0.7
    noise: float = 2.0
    shot_noise: float = 3.0
    fall_off: float = 0.2


def photographed(light: FloatArray, sensor: Sensor, rng: np.random.Generator) -> NDArray[np.uint8]:
    """The picture [row, column, red green blue] of light in 0 to 1, with one or more rays for each pixel averaged."""
    blurred = gaussian_filter(light, (sensor.blur_px, sensor.blur_px, 0.0), mode="nearest")
    height, width = light.shape[:2]
    down, across = np.linspace(-1.0, 1.0, height)[:, None], np.linspace(-1.0, 1.0, width)[None, :]
    lit = 255.0 * blurred * (1.0 - 0.5 * sensor.fall_off * (down**2 + across**2))[:, :, None]
    spread = np.sqrt(sensor.noise**2 + sensor.shot_noise**2 * np.clip(lit, 0.0, 255.0) / 255.0)
    picture: NDArray[np.uint8] = np.clip(np.rint(lit + spread * rng.standard_normal(lit.shape)), 0.0, 255.0).astype(
        np.uint8
    )
    return picture


def averaged(light: FloatArray, samples: int) -> FloatArray:
    """The mean of `samples` × `samples` rays for each pixel."""
    height, width, channels = light.shape
    blocks = light.reshape(height // samples, samples, width // samples, samples, channels)
    mean: FloatArray = blocks.mean(axis=(1, 3))
    return mean
