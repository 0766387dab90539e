"""What a laparoscope sees of breathing tissue, frame by frame, and the truth of each frame."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.geometry.compiled import compiled
from glisson.phantom.breathing.exposing import Shutter
from glisson.phantom.breathing.motion import Motion
from glisson.phantom.breathing.occluders import Glare, Passing
from glisson.phantom.breathing.tissue import TEXEL_MM, Tissue
from glisson.phantom.optics import seen_at, sensor_slopes
from glisson.phantom.photograph import Sensor

_STILL_PX = 0.4
"""Moments of an exposure between which the tissue goes no further than this are averaged."""

_MOST_MOMENTS = 8
_TRUE_MOMENTS = 16
_ROW_STEPS = 4
_NOISE_SHIFTS = 61


@dataclass(frozen=True, eq=False)
class BreathingVideo:
    """A video to be rendered: camera, tissue, what moves and hides it, and how it is recorded."""

    camera: Camera
    tissue: Tissue
    motion: Motion
    frame_count: int
    shutter: Shutter = field(default_factory=Shutter)
    sensor: Sensor = field(default_factory=Sensor)
    glare: Glare | None = None
    passing: tuple[Passing, ...] = ()
    seed: int = 0

    def marks_px(self) -> FloatArray:
        """Where the marks are seen (frames, m, 2) px.

        It is their mean over the exposure of the row in which they are seen.
        """
        height = self.camera.height
        frames = np.arange(self.frame_count)[:, None]
        seen = np.zeros((self.frame_count, len(self.tissue.marks_mm), 2))
        for _ in range(_ROW_STEPS):
            begins = self.shutter.begins(frames, seen[:, :, 1], height)
            seen = self._seen(begins + self.shutter.moments(_TRUE_MOMENTS)[:, None, None]).mean(axis=0)
        return seen

    def marks_visible(self) -> NDArray[np.bool_]:
        """Whether the middle of a mark (frames, m) lies in the image and under nothing that passes."""
        places = self.marks_px()
        size = np.array([self.camera.width, self.camera.height])
        inside: NDArray[np.bool_] = np.all((places > 0.0) & (places < size - 1.0), axis=2)
        cells = np.clip(np.rint(places), 0, size - 1).astype(int)
        for n, time in enumerate(self.times_s):
            for thing in self.passing:
                mask = thing.cover(float(time), (self.camera.height, self.camera.width))
                if mask is not None:
                    inside[n] &= mask[cells[n, :, 1], cells[n, :, 0]] < 128
        return inside

    @property
    def times_s(self) -> FloatArray:
        """The middle of each frame's exposure (s)."""
        return self.shutter.middles(self.frame_count, self.camera.height)

    def images(self) -> Iterator[NDArray[np.uint8]]:
        """The frames [row, column, red green blue]."""
        random = np.random.default_rng([self.seed, 51])
        height, width = self.camera.height, self.camera.width
        noise = random.standard_normal((height + _NOISE_SHIFTS, width + _NOISE_SHIFTS, 3), dtype=np.float32)
        first = self._middle_px(0)
        for frame in range(self.frame_count):
            light = self._light(frame)
            if self.glare is not None:
                self.glare.add(light, self._middle_px(frame) - first)
            for thing in self.passing:
                mask = thing.cover(float(self.times_s[frame]), (height, width))
                if mask is not None:
                    light += (mask / np.float32(255.0))[:, :, None] * (np.array(thing.colour, np.float32) - light)
            if self.sensor.blur_px > 0.0:
                cv2.GaussianBlur(light, (0, 0), self.sensor.blur_px, dst=light)
            down, across = random.integers(0, _NOISE_SHIFTS, 2)
            image = np.zeros((height, width, 3), dtype=np.uint8)
            spread = np.float32(self.sensor.noise), np.float32(self.sensor.shot_noise)
            _develop(light, self._falling, noise[down : down + height, across : across + width], *spread, image)
            yield image

    def _light(self, frame: int) -> NDArray[np.float32]:
        """The mean over a frame's exposure of what comes from the tissue, in 0 to 1."""
        height, width = self.camera.height, self.camera.width
        begins = self.shutter.begins(frame, np.arange(height), height)
        moved = np.diff(self._seen((begins[height // 2] + self.shutter.moments(_TRUE_MOMENTS))[:, None]), axis=0)
        path = float(np.linalg.norm(moved, axis=2).sum(axis=0).max())
        count = min(int(path / _STILL_PX) + 1, _MOST_MOMENTS)
        light = np.zeros((height, width, 3), dtype=np.float32)
        for moment in self.shutter.moments(count):
            place_from_ray = np.linalg.inv(self.tissue.frames(self.motion, begins + moment)).astype(np.float32)
            _add_tissue(self._slopes, place_from_ray, self.tissue.texture, np.float32(1.0 / (255.0 * count)), light)
        return light

    def _seen(self, times_s: FloatArray) -> FloatArray:
        """Pixels (…, m, 2) of the marks at times (…, m) or (…, 1)."""
        points = self.tissue.marks_at(self.motion, times_s)
        return np.asarray(seen_at(self.camera, points.reshape(-1, 3)).reshape(*points.shape[:-1], 2))

    def _middle_px(self, frame: int) -> FloatArray:
        middle = self.tissue.frames(self.motion, self.times_s[frame])[:, 2]
        return np.asarray(seen_at(self.camera, middle[None])[0])

    @cached_property
    def _slopes(self) -> NDArray[np.float32]:
        return sensor_slopes(self.camera).astype(np.float32)

    @cached_property
    def _falling(self) -> NDArray[np.float32]:
        """The light that is left at each pixel after the fall-off, in grey levels."""
        down = np.linspace(-1.0, 1.0, self.camera.height)[:, None]
        across = np.linspace(-1.0, 1.0, self.camera.width)[None, :]
        return np.asarray(255.0 * (1.0 - 0.5 * self.sensor.fall_off * (down**2 + across**2)), dtype=np.float32)


@compiled
def _add_tissue(
    slopes: NDArray[np.float32],
    place_from_ray: NDArray[np.float32],
    texture: NDArray[np.uint8],
    weight: np.float32,
    light: NDArray[np.float32],
) -> None:
    """Add the texture (bilinear) where the rays of the pixels meet the patch, with a matrix for each row."""
    height, width = light.shape[:2]
    rows, columns = texture.shape[:2]
    scale = np.float32(1.0 / TEXEL_MM)
    for v in range(height):
        m = place_from_ray[v]
        for u in range(width):
            x, y = slopes[v, u, 0], slopes[v, u, 1]
            depth = np.float32(1.0) / (m[2, 0] * x + m[2, 1] * y + m[2, 2])
            across = (m[0, 0] * x + m[0, 1] * y + m[0, 2]) * depth * scale + np.float32(0.5 * columns - 0.5)
            down = (m[1, 0] * x + m[1, 1] * y + m[1, 2]) * depth * scale + np.float32(0.5 * rows - 0.5)
            across = min(max(across, np.float32(0.0)), np.float32(columns - 1.001))
            down = min(max(down, np.float32(0.0)), np.float32(rows - 1.001))
            i, j = int(down), int(across)
            a, b = down - np.float32(i), across - np.float32(j)
            for c in range(3):
                top = texture[i, j, c] + b * (np.float32(texture[i, j + 1, c]) - np.float32(texture[i, j, c]))
                low = texture[i + 1, j, c] + b * (
                    np.float32(texture[i + 1, j + 1, c]) - np.float32(texture[i + 1, j, c])
                )
                light[v, u, c] += weight * (top + a * (low - top))


@compiled
def _develop(
    light: NDArray[np.float32],
    falling: NDArray[np.float32],
    normal: NDArray[np.float32],
    dark: np.float32,
    bright: np.float32,
    image: NDArray[np.uint8],
) -> None:
    """Eight bits of light with the sensor's noise."""
    height, width = light.shape[:2]
    for v in range(height):
        for u in range(width):
            for c in range(3):
                value = light[v, u, c] * falling[v, u]
                white = min(max(value, np.float32(0.0)), np.float32(255.0)) / np.float32(255.0)
                value += np.sqrt(dark * dark + bright * bright * white) * normal[v, u, c]
                image[v, u, c] = np.uint8(min(max(value + np.float32(0.5), np.float32(0.0)), np.float32(255.0)))
