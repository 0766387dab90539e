"""The picture that a trocar's camera takes of an instrument's wheel, ray by ray along those of `optics`."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.transform import RigidTransform
from glisson.phantom.optics import seen_at, sensor_slopes
from glisson.phantom.photograph import photographed
from glisson.phantom.wheel_light import add_light
from glisson.phantom.wheel_scene import Finger, Spot, WheelScene

PRINTED = {
    "red": (0.78, 0.10, 0.12), "yellow": (0.88, 0.76, 0.08), "green": (0.06, 0.55, 0.22), "blue": (0.08, 0.25, 0.70),
}  # fmt: skip
"""How the inks reflect red, green and blue light."""

_BEYOND = 1.1
"""Each pixel has several rays up to so many wheel radii from the centre."""
_COARSE = 4
"""What is far behind is so many pixels coarse."""


class WheelViews:
    """Takes pictures with one camera; the frame "trocar" is the camera's."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        self._slopes = sensor_slopes(camera)

    def view(self, scene: WheelScene, behind: FloatArray | None = None) -> NDArray[np.uint8]:
        """The picture [row, column, red green blue].

        Args:
            scene: the instrument, and what lies over it.
            behind: the light (rows, columns, 3) of what is behind, such as a room; None: a ceiling out of focus.
        """
        rng = np.random.default_rng(scene.seed)
        light = _ceiling(self.camera, rng) if behind is None else behind.copy()
        pose, radius = scene.trocar_from_instrument, 0.5 * scene.instrument.wheel_mm
        inks = np.array([PRINTED[name] for name in scene.instrument.colours])
        lit = np.concatenate([scene.light, scene.slope])
        fingers, blood, glare = _finger_rows(scene.fingers), _spot_rows(scene.blood), _spot_rows(scene.glare)
        wheel = (pose.rotation, pose.translation_mm, radius, 0.5 * scene.shaft_mm)
        add_light(light, self._slopes, self._box(pose, radius), *wheel, inks, lit, fingers, blood, glare)
        blur = scene.sensor.blur_px
        blurred = np.clip(gaussian_filter(light, (blur, blur, 0.0), mode="nearest"), 0.0, 1.0)
        return photographed(blurred ** (1.0 / scene.gamma), replace(scene.sensor, blur_px=0.0), rng)

    def _box(self, pose: RigidTransform, radius_mm: float) -> NDArray[np.int64]:
        """First row, row after the last, first column and column after the last about the wheel."""
        angles = np.linspace(0.0, 2.0 * np.pi, 48)
        rim = _BEYOND * radius_mm * np.stack([np.cos(angles), np.sin(angles), np.zeros(48)], axis=1)
        pixels = seen_at(self.camera, pose.apply(rim))
        most = [self.camera.width, self.camera.height]
        left, top = np.clip(np.floor(pixels.min(axis=0)), 0, most)
        right, bottom = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, most)
        return np.array([top, bottom, left, right], dtype=np.int64)


def _finger_rows(fingers: tuple[Finger, ...]) -> FloatArray:
    rows = [(np.cos(one.angle), np.sin(one.angle), one.reach, one.half_width, *one.colour) for one in fingers]
    return np.array(rows, dtype=np.float64).reshape(-1, 7)


def _spot_rows(spots: tuple[Spot, ...]) -> FloatArray:
    return np.array([(one.x, one.y, one.radius, one.strength) for one in spots], dtype=np.float64).reshape(-1, 4)


def _ceiling(camera: Camera, rng: np.random.Generator) -> FloatArray:
    """A ceiling out of focus, with lamps, and with drapes and other things of all colours."""
    high, wide = -(-camera.height // _COARSE), -(-camera.width // _COARSE)
    rough = 0.45 + 0.25 * rng.standard_normal((6, 8, 1)) + 0.08 * rng.standard_normal((6, 8, 3))
    light = _stretched(np.clip(rough, 0.0, 1.0), high, wide)
    rows, columns = np.ogrid[:high, :wide]
    for _ in range(int(rng.integers(2, 6))):
        away = np.hypot(rows - rng.uniform(0, high), columns - rng.uniform(0, wide))
        light[away < rng.uniform(0.03, 0.09) * wide] = rng.uniform(0.9, 1.2)
    for _ in range(int(rng.integers(2, 6))):
        top, left = int(rng.uniform(0, high)), int(rng.uniform(0, wide))
        tall, broad = (rng.uniform(0.05, 0.3, 2) * [high, wide]).astype(int)
        light[top : top + tall, left : left + broad] = rng.uniform(0.05, 0.8, 3)
    fine: FloatArray = np.repeat(np.repeat(light, _COARSE, axis=0), _COARSE, axis=1)
    return np.ascontiguousarray(fine[: camera.height, : camera.width])


def _stretched(rough: FloatArray, high: int, wide: int) -> FloatArray:
    """A grid (n, m, 3) made (high, wide, 3) by straight lines between its points."""
    rows, columns = np.linspace(0, len(rough) - 1, high), np.linspace(0, rough.shape[1] - 1, wide)
    top = np.minimum(rows.astype(int), len(rough) - 2)
    left = np.minimum(columns.astype(int), rough.shape[1] - 2)
    down, across = (rows - top)[:, None, None], (columns - left)[None, :, None]
    tall = (1.0 - down) * rough[top] + down * rough[top + 1]
    stretched: FloatArray = (1.0 - across) * tall[:, left] + across * tall[:, left + 1]
    return stretched
