"""Pictures through a laparoscope: a surface lit from the scope's tip, and a tool that touches it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.phantom.optics import sensor_slopes
from glisson.phantom.photograph import Sensor, photographed

_AMBIENT = 0.12
_GLARE_SHARPNESS = 150.0
_EXPOSED = 5.0
"""The picture is exposed for what is nearest."""

_TAPER = 0.4
_STEEL = np.array([0.62, 0.64, 0.68])
_TOOL_STEPS = 60


class Surface(Protocol):
    """What is looked at, in the frame "room"."""

    def hits(self, origin: FloatArray, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances (n,) along unit rays (n, 3) from an origin (3,), infinite where nothing is, and normals (n, 3)."""

    def colours(self, points_mm: FloatArray) -> FloatArray:
        """Red, green and blue (n, 3) in 0 to 1 of points (n, 3) on it."""


@dataclass(frozen=True, eq=False)
class Tool:
    """A round shaft from its tip (3,) into a direction (3,), with a radius (mm)."""

    tip_mm: FloatArray
    direction: FloatArray
    radius_mm: float = 2.5


@dataclass(frozen=True, eq=False)
class Place:
    """Where the scope is: `rotation` (3, 3) has the image's right, down and forward as columns; `centre_mm` (3,)."""

    rotation: FloatArray
    centre_mm: FloatArray


def picture_through(
    camera: Camera,
    place: Place,
    surface: Surface,
    tool: Tool,
    rng: np.random.Generator,
    sensor: Sensor | None = None,
    glare: float = 0.5,
) -> NDArray[np.uint8]:
    """The picture [row, column, red green blue].

    The light sits at the centre of projection and falls with the square of the distance; `glare` is what a mirror-like
    spot adds.
    """
    slopes = sensor_slopes(camera)
    rays = np.concatenate([slopes.reshape(-1, 2), np.ones((slopes[..., 0].size, 1))], axis=1)
    rays = rays / np.linalg.norm(rays, axis=1, keepdims=True) @ place.rotation.T
    far, normals = surface.hits(place.centre_mm, rays)
    light = np.zeros((len(rays), 3))
    seen = np.isfinite(far)
    points = place.centre_mm + far[seen, None] * rays[seen]
    reference = float(np.percentile(far[seen], _EXPOSED))
    light[seen] = _lit(surface.colours(points), rays[seen], normals[seen], far[seen] / reference, glare)
    near, across = _tool_hits(tool, place.centre_mm, rays)
    covered = near < far
    light[covered] = _lit(
        np.tile(_STEEL, (int(covered.sum()), 1)), rays[covered], across[covered], near[covered] / reference, glare
    )
    shown = np.clip(light.reshape(camera.height, camera.width, 3), 0.0, 1.0)
    return photographed(shown, sensor or Sensor(), rng)


def _lit(colours: FloatArray, rays: FloatArray, normals: FloatArray, distance: FloatArray, glare: float) -> FloatArray:
    facing = np.clip(-(rays * normals).sum(axis=1), 0.0, 1.0)
    diffuse = (_AMBIENT + (1.0 - _AMBIENT) * facing) / distance**2
    light: FloatArray = colours * diffuse[:, None] + glare * facing[:, None] ** _GLARE_SHARPNESS
    return light


def _tool_hits(tool: Tool, origin: FloatArray, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances (n,) to a shaft that ends in a cone with its point at the tip, and normals (n, 3).

    A ray is followed by the distance to the shaft, which is never more than how far it is.
    """
    axis = tool.direction / np.linalg.norm(tool.direction)
    start = origin - tool.tip_mm
    # Rays that pass the axis beyond its radius never meet the shaft.
    cross = np.cross(rays, axis)
    passing = np.abs(cross @ start) / np.maximum(np.linalg.norm(cross, axis=1), 1e-9)
    near = np.flatnonzero(passing < tool.radius_mm)
    travelled = np.zeros(len(near))
    for _ in range(_TOOL_STEPS):
        travelled += _tool_distance(tool.radius_mm, axis, start + travelled[:, None] * rays[near])
    places = start + travelled[:, None] * rays[near]
    met = np.abs(_tool_distance(tool.radius_mm, axis, places)) < 1e-2
    far, normals = np.full(len(rays), np.inf), np.zeros((len(rays), 3))
    far[near[met]] = travelled[met]
    along = places @ axis
    out = places - along[:, None] * axis
    out = out / np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
    tapered = along * _TAPER < tool.radius_mm
    out[tapered] = (out[tapered] - _TAPER * axis) / np.hypot(1.0, _TAPER)
    normals[near[met]] = out[met]
    return far, normals


def _tool_distance(radius: float, axis: FloatArray, places: FloatArray) -> FloatArray:
    along = places @ axis
    off = np.linalg.norm(places - along[:, None] * axis, axis=1)
    distance: FloatArray = np.maximum(off - radius, (off - _TAPER * along) / np.hypot(1.0, _TAPER))
    return distance
