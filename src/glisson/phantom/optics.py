"""Where a camera sees what, for rendered views.

It is written apart from the projection that estimators use, so that a slip there does not hide in the truth here.
"""

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera

_STEPS = 30


def seen_at(camera: Camera, points_mm: ArrayLike) -> FloatArray:
    """Pixels (n, 2) of points (n, 3) before the camera, in its frame."""
    points = np.asarray(points_mm, dtype=np.float64)
    return np.asarray(_distorted(camera, points[:, :2] / points[:, 2:])) * camera.focal_px + camera.centre_px


def ray_slopes(camera: Camera, pixels: ArrayLike) -> FloatArray:
    """The slopes x / z, y / z (n, 2) of the rays that meet the sensor at pixels (n, 2).

    Newton's method undoes the distortion; where there is no such ray (far outside the image) the slopes are NaN.
    """
    wanted = (np.asarray(pixels, dtype=np.float64) - camera.centre_px) / camera.focal_px
    slopes = wanted.copy()
    for _ in range(_STEPS):
        off = _distorted(camera, slopes) - wanted
        if np.abs(off).max(initial=0.0) < 1e-13:
            break
        slopes = slopes - np.linalg.solve(_stretching(camera, slopes), off[:, :, None])[:, :, 0]
    slopes[np.abs(_distorted(camera, slopes) - wanted).max(axis=1, initial=0.0) > 1e-9] = np.nan
    return slopes


def sensor_slopes(camera: Camera, samples: int = 1) -> FloatArray:
    """Slopes (height · samples, width · samples, 2) of the rays through all pixels.

    `samples` rays a side go through each pixel, evenly spread.
    """
    across = (np.arange(camera.width * samples) + 0.5) / samples - 0.5
    down = (np.arange(camera.height * samples) + 0.5) / samples - 0.5
    pixels = np.stack(np.meshgrid(across, down), axis=-1)
    return ray_slopes(camera, pixels.reshape(-1, 2)).reshape(pixels.shape)


def _distorted(camera: Camera, slopes: FloatArray) -> FloatArray:
    k1, k2, p1, p2, k3 = camera.distortion
    x, y = slopes[:, 0], slopes[:, 1]
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    return np.stack(
        [
            x * radial + 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x),
            y * radial + p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y,
        ],
        axis=1,
    )


def _stretching(camera: Camera, slopes: FloatArray) -> FloatArray:
    """The derivative (n, 2, 2) of what distortion makes of slopes."""
    k1, k2, p1, p2, k3 = camera.distortion
    x, y = slopes[:, 0], slopes[:, 1]
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * (k2 + square * k3))
    slope = k1 + square * (2.0 * k2 + square * 3.0 * k3)
    mixed = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y
    first = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x
    second = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x
    return np.stack([np.stack([first, mixed], axis=1), np.stack([mixed, second], axis=1)], axis=1)
