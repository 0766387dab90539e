"""Rendered views of a room, pixel by pixel along the rays of `optics`."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, maximum_filter

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.crosses import Cross
from glisson.core.transform import RigidTransform
from glisson.geometry.compiled import compiled
from glisson.phantom.optics import seen_at, sensor_slopes
from glisson.phantom.photograph import Sensor, photographed
from glisson.phantom.room_scene import Patch, Scene

_SAMPLES = 4
_MARGIN_PX = 3


class RoomViews:
    """Takes pictures with one camera."""

    def __init__(self, camera: Camera) -> None:
        self.camera = camera
        self._slopes = sensor_slopes(camera)
        self._widest = 1.3 * np.abs(self._slopes).max(axis=(0, 1))

    def view(
        self,
        scene: Scene,
        room_from_camera: RigidTransform,
        sensor: Sensor,
        rng: np.random.Generator,
        gamma: float = 1.0,
    ) -> NDArray[np.uint8]:
        """The picture [row, column, red green blue] from a pose; its levels are the light's to the power 1 / gamma."""
        light = self.light(scene, room_from_camera, rng)
        # The lens blurs light, not levels.
        blurred = gaussian_filter(light, (sensor.blur_px, sensor.blur_px, 0.0), mode="nearest")
        return photographed(np.clip(blurred, 0.0, 1.0) ** (1.0 / gamma), replace(sensor, blur_px=0.0), rng)

    def light(self, scene: Scene, room_from_camera: RigidTransform, rng: np.random.Generator) -> FloatArray:
        """What falls on the sensor, 1 is white; sheets are sampled by 16 rays for each pixel."""
        rotation, centre = room_from_camera.rotation, room_from_camera.translation_mm
        lit = (scene.gradient, scene.tint)
        light, covered = _room_light(
            self._slopes, rotation, centre, scene.size_mm, scene.wall_colours, scene.rods, scene.rod_colours, *lit
        )
        near_rods = maximum_filter(covered, 5)
        for patch in scene.patches:
            window = self._window(patch, room_from_camera)
            if window is not None:
                plane = np.array([patch.centre_mm, patch.right, patch.down])
                sizes = np.array([*patch.half_mm, patch.cross_mm])
                own = (window, rotation, centre, plane, sizes, patch.colours)
                _add_patch(light, self._slopes, *own, scene.rods, near_rods, *lit, scene.glare, rng)
        return light

    def visible(self, scene: Scene, cross: Cross, room_from_camera: RigidTransform) -> bool:
        """Whether all twelve corners of a cross are in the picture, and nothing covers them or the squares' middles."""
        places = np.vstack([cross.corners_mm, cross.in_room(cross.size_mm / 3.0 * _SQUARES)])
        in_camera = room_from_camera.inverse().apply(places)
        into_wall = cross.room_from_cross.rotation[:, 2]
        if (in_camera[:, 2] < 1.0).any() or (places[0] - room_from_camera.translation_mm) @ into_wall <= 0.0:
            return False
        pixels = seen_at(self.camera, in_camera)
        inside = (pixels > 1.0).all() and (pixels < [self.camera.width - 2.0, self.camera.height - 2.0]).all()
        centre = room_from_camera.translation_mm
        rays = places - centre
        return bool(inside) and all(
            _first_rod(centre[0], centre[1], centre[2], ray[0], ray[1], ray[2], scene.rods, 1.0) < 0 for ray in rays
        )

    def corners(self, cross: Cross, room_from_camera: RigidTransform) -> FloatArray:
        """Where its corners are (12, 2), px."""
        return seen_at(self.camera, room_from_camera.inverse().apply(cross.corners_mm))

    def _window(self, patch: Patch, room_from_camera: RigidTransform) -> NDArray[np.int64] | None:
        """First and last row and column between which a sheet is seen; None where it is not."""
        if (patch.centre_mm - room_from_camera.translation_mm) @ np.cross(patch.right, patch.down) <= 0.0:
            return None
        steps = np.linspace(-1.0, 1.0, 17)
        grid = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2) * patch.half_mm
        places = patch.centre_mm + grid[:, :1] * patch.right + grid[:, 1:] * patch.down
        in_camera = room_from_camera.inverse().apply(places)
        # Far outside the image the distortion's polynomial comes back into it. The steps are smaller than what is kept
        # beyond the image, so that no part within it is lost.
        slopes = np.abs(in_camera[:, :2] / np.maximum(in_camera[:, 2:], 1e-6))
        near = (in_camera[:, 2] > 1.0) & (slopes < self._widest).all(axis=1)
        if not near.any():
            return None
        pixels = seen_at(self.camera, in_camera[near])
        top = [self.camera.width - 1, self.camera.height - 1]
        low = np.clip(np.floor(pixels.min(axis=0)) - _MARGIN_PX, 0, top)
        high = np.clip(np.ceil(pixels.max(axis=0)) + _MARGIN_PX, 0, top)
        if (low >= high).any():
            return None
        return np.array([low[1], high[1], low[0], high[0]], dtype=np.int64)


_SQUARES = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


@compiled
def _first_rod(
    cx: float, cy: float, cz: float, rx: float, ry: float, rz: float, rods: FloatArray, before: float
) -> int:
    """Number of the nearest rod that a ray passes through before `before` of its length; −1: none."""
    found, nearest = -1, before
    ray_square = rx * rx + ry * ry + rz * rz
    for n in range(len(rods)):
        ax, ay, az = rods[n, 0] - cx, rods[n, 1] - cy, rods[n, 2] - cz
        bx, by, bz = rods[n, 3] - rods[n, 0], rods[n, 4] - rods[n, 1], rods[n, 5] - rods[n, 2]
        square = bx * bx + by * by + bz * bz
        mixed = bx * rx + by * ry + bz * rz
        along_a = ax * rx + ay * ry + az * rz
        along_b = ax * bx + ay * by + az * bz
        share = 0.0
        across = ray_square * square - mixed * mixed
        if across > 1e-9 * ray_square * square:
            share = min(max((mixed * along_a - ray_square * along_b) / across, 0.0), 1.0)
        reach = (along_a + share * mixed) / ray_square
        if reach <= 0.0 or reach >= nearest:
            continue
        x, y, z = ax + share * bx - reach * rx, ay + share * by - reach * ry, az + share * bz - reach * rz
        if x * x + y * y + z * z < rods[n, 6] * rods[n, 6]:
            found, nearest = n, reach
    return found


@compiled
def _shine(x: float, y: float, z: float, glare: FloatArray) -> float:
    """Share of a lamp's reflection in what is seen at a place."""
    shine = 0.0
    for n in range(len(glare)):
        off = (x - glare[n, 0]) ** 2 + (y - glare[n, 1]) ** 2 + (z - glare[n, 2]) ** 2
        spread = glare[n, 3] * glare[n, 3]
        if off < 9.0 * spread:
            shine = max(shine, glare[n, 4] * np.exp(-0.5 * off / spread))
    return shine


@compiled
def _room_light(
    slopes: FloatArray, rotation: FloatArray, centre: FloatArray, size: FloatArray, walls: FloatArray,
    rods: FloatArray, rod_colours: FloatArray, gradient: FloatArray, tint: FloatArray,
) -> tuple[FloatArray, NDArray[np.uint8]]:  # fmt: skip
    """The picture of walls and rods, one ray for each pixel, and where there are rods."""
    height, width = slopes.shape[:2]
    light, covered = np.zeros((height, width, 3)), np.zeros((height, width), dtype=np.uint8)
    low, high = np.array([-size[0] / 2.0, -size[1] / 2.0, 0.0]), np.array([size[0] / 2.0, size[1] / 2.0, size[2]])
    ray = np.zeros(3)
    for row in range(height):
        for column in range(width):
            x, y = slopes[row, column, 0], slopes[row, column, 1]
            nearest, side = np.inf, 0
            for k in range(3):
                ray[k] = rotation[k, 0] * x + rotation[k, 1] * y + rotation[k, 2]
                if abs(ray[k]) > 1e-12:
                    reach = ((high[k] if ray[k] > 0.0 else low[k]) - centre[k]) / ray[k]
                    if reach < nearest:
                        nearest, side = reach, 2 * k + (1 if ray[k] > 0.0 else 0)
            level = 1.0
            for k in range(3):
                level += (centre[k] + nearest * ray[k]) * gradient[k]
            level = max(level, 0.2)
            rod = _first_rod(centre[0], centre[1], centre[2], ray[0], ray[1], ray[2], rods, nearest)
            covered[row, column] = 1 if rod >= 0 else 0
            for k in range(3):
                light[row, column, k] = (rod_colours[rod, k] if rod >= 0 else walls[side, k]) * level * tint[k]
    return light, covered


@compiled
def _add_patch(
    light: FloatArray, slopes: FloatArray, window: NDArray[np.int64], rotation: FloatArray, centre: FloatArray,
    plane: FloatArray, sizes: FloatArray, colours: FloatArray, rods: FloatArray, near_rods: NDArray[np.uint8],
    gradient: FloatArray, tint: FloatArray, glare: FloatArray, rng: np.random.Generator,
) -> None:  # fmt: skip
    """Put a sheet into the picture; rays are spread at random within a pixel's 16 parts, which has no bias.

    `near_rods` is 1 where a rod may be seen.
    """
    height, width = slopes.shape[:2]
    # The ray (x, y, 1) of the camera in the frame of the sheet: across, along and towards it.
    frame = np.zeros((3, 3))
    frame[0], frame[1], frame[2] = plane[1], plane[2], np.cross(plane[1], plane[2])
    turned, from_middle = frame @ rotation, frame @ (centre - plane[0])
    seen = np.zeros(3)
    for row in range(window[0], window[1] + 1):
        for column in range(window[2], window[3] + 1):
            east, west = min(column + 1, width - 1), max(column - 1, 0)
            south, north = min(row + 1, height - 1), max(row - 1, 0)
            xu = (slopes[row, east, 0] - slopes[row, west, 0]) / (east - west)
            yu = (slopes[row, east, 1] - slopes[row, west, 1]) / (east - west)
            xv = (slopes[south, column, 0] - slopes[north, column, 0]) / (south - north)
            yv = (slopes[south, column, 1] - slopes[north, column, 1]) / (south - north)
            # Where a pixel's corners see the same square, and no rod is near, one ray will do.
            first, same = -2, True
            for corner in range(4):
                u, v = corner % 2 - 0.5, corner // 2 - 0.5
                x, y = slopes[row, column, 0] + u * xu + v * xv, slopes[row, column, 1] + u * yu + v * yv
                reach = -from_middle[2] / max(turned[2, 0] * x + turned[2, 1] * y + turned[2, 2], 1e-9)
                across = from_middle[0] + reach * (turned[0, 0] * x + turned[0, 1] * y + turned[0, 2])
                along = from_middle[1] + reach * (turned[1, 0] * x + turned[1, 1] * y + turned[1, 2])
                square = _square(across, along, sizes)
                same = same and (corner == 0 or square == first)
                first = square
            if same and first < 0:
                continue
            alone = same and near_rods[row, column] == 0
            rays = 1 if alone else _SAMPLES * _SAMPLES
            met = 0
            seen[:] = 0.0
            for part in range(rays):
                u, v = 0.0, 0.0
                if not alone:
                    u = (part % _SAMPLES + rng.random()) / _SAMPLES - 0.5
                    v = (part // _SAMPLES + rng.random()) / _SAMPLES - 0.5
                x, y = slopes[row, column, 0] + u * xu + v * xv, slopes[row, column, 1] + u * yu + v * yv
                reach = -from_middle[2] / max(turned[2, 0] * x + turned[2, 1] * y + turned[2, 2], 1e-9)
                across = from_middle[0] + reach * (turned[0, 0] * x + turned[0, 1] * y + turned[0, 2])
                along = from_middle[1] + reach * (turned[1, 0] * x + turned[1, 1] * y + turned[1, 2])
                square = _square(across, along, sizes)
                rx = rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2]
                ry = rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2]
                rz = rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2]
                if square < 0 or (
                    not alone and _first_rod(centre[0], centre[1], centre[2], rx, ry, rz, rods, reach) >= 0
                ):
                    continue
                met += 1
                px, py, pz = centre[0] + reach * rx, centre[1] + reach * ry, centre[2] + reach * rz
                level = max(1.0 + px * gradient[0] + py * gradient[1] + pz * gradient[2], 0.2)
                shine = _shine(px, py, pz, glare)
                for k in range(3):
                    seen[k] += (colours[square, k] * (1.0 - shine) + shine) * level * tint[k]
            for k in range(3):
                light[row, column, k] = (seen[k] + (rays - met) * light[row, column, k]) / rays


@compiled
def _square(across: float, along: float, sizes: FloatArray) -> int:
    """Which of a cross's colours is at a place of its paper; 0: the paper itself; −1: beside it."""
    if abs(across) > sizes[0] or abs(along) > sizes[1]:
        return -1
    arm, end = sizes[2] / 6.0, sizes[2] / 2.0
    if abs(across) > end or abs(along) > end or (abs(across) > arm and abs(along) > arm):
        return 0
    if abs(across) <= arm and abs(along) <= arm:
        return 1
    if abs(across) > arm:
        return 2 if across > 0.0 else 4
    return 3 if along > 0.0 else 5
