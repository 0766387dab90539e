"""Ray casting with Embree: transparent layers over opaque bodies, with fine outlines."""

from typing import NamedTuple

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.geometry.normals import vertex_normals
from glisson.navigation.rendering.ambient_light import ambient_light
from glisson.navigation.rendering.blending import blend
from glisson.navigation.rendering.bodies import Body
from glisson.navigation.rendering.camera import Camera
from glisson.navigation.rendering.shading import Floats, Hits, shade, values_at

_OVERSAMPLING = 2
_PEELS = 2
"""Surfaces of a transparent body that are drawn: the front and what lies behind it (the far wall)."""

_INK = np.array([0.16, 0.15, 0.17], dtype=np.float32)
_BEYOND_MM = np.float32(1e-3)


class _Layer(NamedTuple):
    """One surface within a window of the picture (r × c rays): depth in mm (inf: none), colour, opacity."""

    window: tuple[slice, slice]
    depth: Floats
    colour: Floats
    opacity: Floats


def cast(bodies: list[Body], camera: Camera) -> NDArray[np.uint8]:
    """Picture (height, width, 3) of bodies, 8-bit sRGB on white, each pixel the mean of four rays.

    Opaque bodies are met once by each ray, transparent ones twice.
    """
    reach = 10.0 + max(float(np.linalg.norm(b.vertices - camera.centre, axis=1).max()) for b in bodies)
    parts = [
        (_fine(layer.window), layer.depth, layer.colour, layer.opacity, body.inner)
        for body, sky in zip(bodies, ambient_light(bodies), strict=True)
        for layer in _layers(body, sky, camera, reach)
    ]
    picture = np.ones((camera.height * _OVERSAMPLING, camera.width * _OVERSAMPLING, 3), dtype=np.float32)
    blend(picture, parts)
    small = picture.reshape(camera.height, _OVERSAMPLING, camera.width, _OVERSAMPLING, 3).mean(axis=(1, 3))
    eight_bit: NDArray[np.uint8] = (255.0 * np.clip(small, 0.0, 1.0) + 0.5).astype(np.uint8)
    return eight_bit


def _fine(window: tuple[slice, slice]) -> tuple[slice, slice]:
    rows, columns = (slice(part.start * _OVERSAMPLING, part.stop * _OVERSAMPLING) for part in window)
    return rows, columns


def _layers(body: Body, sky: FloatArray, camera: Camera, reach: float) -> list[_Layer]:
    """The body's visible surfaces, front first; `sky` is the light (n,) at its vertices."""
    window = camera.window(body.vertices)
    origins = camera.rays(window, _OVERSAMPLING, reach).astype(np.float32)
    shape, starts = origins.shape[:2], origins.reshape(-1, 3)
    scene = EmbreeScene()
    TriangleMesh(scene, body.vertices.astype(np.float32), body.triangles.astype(np.int32))
    normals, forward = vertex_normals(body.vertices, body.triangles), camera.forward.astype(np.float32)
    ahead = np.tile(forward, (len(starts), 1))
    rays, travelled = np.arange(len(starts)), np.zeros(len(starts), dtype=np.float32)
    layers: list[_Layer] = []
    for _ in range(_PEELS if body.opacity < 1.0 else 1):
        found = scene.run(starts, ahead[: len(starts)], output=1)
        met = np.flatnonzero(found["primID"] >= 0)
        if len(met) == 0:
            break
        hits = Hits(*(found[name][met] for name in ("primID", "u", "v", "Ng", "tfar")))
        rays, travelled = rays[met], travelled[met] + hits.distance
        finish = (body.smooth, body.gloss, body.opacity)
        colour, opacity = shade(hits, body.triangles, normals, sky, _base_colour(body, hits), finish, camera)
        layers.append(_spread(window, shape, rays, travelled, colour, opacity))
        if body.ink:
            _draw_outline(layers[-1], camera.mm_per_pixel)
        starts = starts[met] + (hits.distance + _BEYOND_MM)[:, None] * forward
        travelled = travelled + _BEYOND_MM
    return layers


def _base_colour(body: Body, hits: Hits) -> Floats:
    """The body's own colour (1, 3), or that of its values at each hit (n, 3)."""
    if body.values is None or body.palette is None:
        return np.array([body.colour], dtype=np.float32)
    return body.palette(values_at(hits, body.triangles, body.values)).astype(np.float32)


def _spread(
    window: tuple[slice, slice],
    shape: tuple[int, ...],
    rays: NDArray[np.int64],
    depth: Floats,
    colour: Floats,
    opacity: Floats,
) -> _Layer:
    """Values of some rays, put into the whole window."""
    whole = np.full(shape[0] * shape[1], np.inf, dtype=np.float32)
    colours, opacities = np.zeros((len(whole), 3), dtype=np.float32), np.zeros(len(whole), dtype=np.float32)
    whole[rays], colours[rays], opacities[rays] = depth, colour, opacity
    return _Layer(window, whole.reshape(shape), colours.reshape(*shape, 3), opacities.reshape(shape))


def _draw_outline(layer: _Layer, mm_per_pixel: float) -> None:
    """Darken the rays of a layer beside which its surface ends or lies much farther back."""
    far = np.where(np.isfinite(layer.depth), layer.depth, np.float32(1e6))
    jump, lines = 4.0 * mm_per_pixel, np.zeros(far.shape, dtype=bool)
    lines[1:] |= far[:-1] - far[1:] > jump
    lines[:-1] |= far[1:] - far[:-1] > jump
    lines[:, 1:] |= far[:, :-1] - far[:, 1:] > jump
    lines[:, :-1] |= far[:, 1:] - far[:, :-1] > jump
    layer.colour[lines] = 0.35 * layer.colour[lines] + 0.65 * _INK
    layer.opacity[lines] = np.maximum(layer.opacity[lines], 0.75)
