"""The picture that a trocar's camera takes of an instrument's wheel."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.instruments import RINGS, SECTORS
from glisson.phantom.optics import seen_at, sensor_slopes
from glisson.phantom.photograph import averaged, photographed
from glisson.phantom.wheel_scene import WheelScene

PRINTED = {
    "red": (0.78, 0.10, 0.12), "yellow": (0.88, 0.76, 0.08), "green": (0.06, 0.55, 0.22), "blue": (0.08, 0.25, 0.70),
}  # fmt: skip
"""How the inks reflect red, green and blue light."""
_WHITE, _BLACK, _HUB = 0.86, 0.05, 0.15
_BLOOD = np.array([0.34, 0.03, 0.04])
_SAMPLES = 3
_BEYOND = 1.15
"""Rays are dense up to so many wheel radii from the centre."""


def wheel_picture(camera: Camera, scene: WheelScene) -> NDArray[np.uint8]:
    """The picture [row, column, red green blue]; the frame "trocar" is the camera's."""
    rng = np.random.default_rng(scene.seed)
    slopes = _slopes(camera)
    light = _behind(camera, rng)
    light = _with_wheel(scene, slopes.reshape(-1, 2), light.reshape(-1, 3)).reshape(light.shape)
    rows, columns = _box(camera, scene)
    if rows.stop > rows.start and columns.stop > columns.start:
        fine = _between(slopes, rows, columns)
        behind = np.repeat(np.repeat(light[rows, columns], _SAMPLES, axis=0), _SAMPLES, axis=1)
        seen = _with_wheel(scene, fine.reshape(-1, 2), behind.reshape(-1, 3)).reshape(behind.shape)
        light[rows, columns] = averaged(seen, _SAMPLES)
    return photographed(np.clip(light, 0.0, 1.0), scene.sensor, rng)


@lru_cache(maxsize=2)
def _slopes(camera: Camera) -> FloatArray:
    return sensor_slopes(camera)


def _box(camera: Camera, scene: WheelScene) -> tuple[slice, slice]:
    """The rows and columns about the wheel."""
    angles = np.linspace(0.0, 2.0 * np.pi, 48)
    flat = 0.5 * _BEYOND * scene.instrument.wheel_mm * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)
    pixels = seen_at(camera, scene.trocar_from_instrument.apply(flat))
    least = np.clip(np.floor(pixels.min(axis=0)), 0, [camera.width, camera.height]).astype(int)
    most = np.clip(np.ceil(pixels.max(axis=0)) + 1, 0, [camera.width, camera.height]).astype(int)
    return slice(least[1], most[1]), slice(least[0], most[0])


def _between(slopes: FloatArray, rows: slice, columns: slice) -> FloatArray:
    """Slopes of `_SAMPLES` rays a side for each pixel; within one pixel they change evenly to 1e-7."""
    by_row, by_column = np.gradient(slopes, axis=(0, 1))
    steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES - 0.5
    piece = slopes[rows, columns][:, None, :, None, :]
    down = by_row[rows, columns][:, None, :, None, :] * steps[:, None, None, None]
    across = by_column[rows, columns][:, None, :, None, :] * steps[:, None]
    fine = piece + down + across
    height, _, width, _, _ = fine.shape
    return fine.reshape(height * _SAMPLES, width * _SAMPLES, 2)


def _with_wheel(scene: WheelScene, slopes: FloatArray, light: FloatArray) -> FloatArray:
    """Light (n, 3) of rays (n, 2), with wheel and shaft before what is behind."""
    pose = scene.trocar_from_instrument
    rays = np.column_stack([slopes, np.ones(len(slopes))])
    axis = pose.rotation[:, 2]
    depth = float(pose.translation_mm @ axis) / (rays @ axis)
    places = (rays * depth[:, None] - pose.translation_mm) @ pose.rotation[:, :2] / (0.5 * scene.instrument.wheel_mm)
    on_wheel = np.hypot(*places.T) <= 1.0
    seen = light.copy()
    seen[on_wheel] = _painted(scene, places[on_wheel])
    near = np.hypot(*places.T) <= 3.0
    seen[near] = _with_fingers(scene, places[near], seen[near])
    return _with_shaft(scene, rays, depth, seen)


def _painted(scene: WheelScene, places: FloatArray) -> FloatArray:
    """Light from places (n, 2) of the wheel's face, in wheel radii."""
    radius = np.hypot(*places.T)
    sector = np.floor(np.arctan2(places[:, 1], places[:, 0]) % (2.0 * np.pi) / (2.0 * np.pi / SECTORS)).astype(int)
    inks = np.array([PRINTED[name] for name in scene.instrument.colours])[sector % SECTORS]
    seen = np.full((len(places), 3), _WHITE)
    seen[radius > RINGS.white] = _BLACK
    coloured = (radius > RINGS.inner) & (radius < RINGS.outer)
    seen[coloured] = inks[coloured]
    seen[radius < RINGS.hole] = _HUB
    for spot in scene.blood:
        inside = np.hypot(places[:, 0] - spot.x, places[:, 1] - spot.y) < spot.radius
        seen[inside] += spot.strength * (_BLOOD - seen[inside])
    seen *= scene.light * (1.0 + places @ scene.slope)[:, None]
    for spot in scene.glare:
        away = np.hypot(places[:, 0] - spot.x, places[:, 1] - spot.y) / spot.radius
        seen += spot.strength * np.exp(-0.5 * away**2)[:, None]
    return seen


def _with_fingers(scene: WheelScene, places: FloatArray, light: FloatArray) -> FloatArray:
    for finger in scene.fingers:
        towards = np.array([np.cos(finger.angle), np.sin(finger.angle)])
        along = places @ towards - finger.reach - finger.half_width
        beside = np.hypot(np.minimum(along, 0.0), places @ [-towards[1], towards[0]]) / finger.half_width
        inside = beside < 1.0
        rounded = np.sqrt(1.0 - 0.7 * beside[inside] ** 2)
        light[inside] = np.array(finger.colour) * scene.light * rounded[:, None]
    return light


def _with_shaft(scene: WheelScene, rays: FloatArray, depth: FloatArray, light: FloatArray) -> FloatArray:
    """The shaft from the wheel towards the tip, a steel cylinder that passes beside the camera."""
    pose = scene.trocar_from_instrument
    axis, radius = pose.rotation[:, 2], 0.5 * scene.shaft_mm
    across = rays - (rays @ axis)[:, None] * axis
    foot = pose.translation_mm - (pose.translation_mm @ axis) * axis
    squared, mixed = np.einsum("ij,ij->i", across, across), across @ foot
    inner = mixed**2 - squared * (foot @ foot - radius**2)
    hit = inner > 0.0
    nearest = np.full(len(rays), np.inf)
    nearest[hit] = (mixed[hit] - np.sqrt(inner[hit])) / squared[hit]
    hit &= (nearest > 0.0) & (nearest < depth)
    normal = (nearest[hit, None] * across[hit] - foot) / radius
    facing = np.abs(np.einsum("ij,ij->i", normal, across[hit])) / np.sqrt(squared[hit])
    steel = 0.12 + 0.45 * facing**2 + 0.35 * facing**24
    light[hit] = steel[:, None] * scene.light
    return light


def _behind(camera: Camera, rng: np.random.Generator) -> FloatArray:
    """A ceiling out of focus, with drapes in their colours and with lamps."""
    size = np.array([camera.height, camera.width])
    rough = np.clip(0.45 + 0.25 * rng.standard_normal((6, 8, 1)) + 0.08 * rng.standard_normal((6, 8, 3)), 0.0, 1.0)
    light: FloatArray = zoom(rough, (size[0] / 6.0, size[1] / 8.0, 1.0), order=1)
    rows, columns = np.indices(size)
    for _ in range(int(rng.integers(2, 6))):
        away = np.hypot(rows - rng.uniform(0, size[0]), columns - rng.uniform(0, size[1]))
        light[away < rng.uniform(0.03, 0.09) * size[1]] = rng.uniform(0.9, 1.2)
    for _ in range(int(rng.integers(2, 6))):
        top, left = rng.uniform(0, size[0]), rng.uniform(0, size[1])
        high, wide = rng.uniform(0.05, 0.3, 2) * size
        inside = (rows > top) & (rows < top + high) & (columns > left) & (columns < left + wide)
        light[inside] = rng.uniform(0.05, 0.8, 3)
    return light
