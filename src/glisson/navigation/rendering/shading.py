"""Light on surfaces, computed point by point in compiled code."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.compiled import compiled
from glisson.navigation.rendering.camera import Camera

Floats = NDArray[np.float32]

_AMBIENT, _KEY, _HEAD = 0.50, 0.36, 0.26
_SHARPNESS = 40


class Hits(NamedTuple):
    """Where n rays met a body: triangle (n,), barycentric u, v (n,), its normal (n, 3), distance (n,) in mm."""

    triangle: NDArray[np.int32]
    u: Floats
    v: Floats
    normal: Floats
    distance: Floats


def values_at(hits: Hits, triangles: IntArray, values: FloatArray) -> FloatArray:
    """Vertex values (v,) interpolated where rays met the body, (n,)."""
    return _values_at(hits.triangle, hits.u, hits.v, triangles, values)


@compiled
def _values_at(
    triangle: NDArray[np.int32], u: Floats, v: Floats, triangles: IntArray, values: FloatArray
) -> FloatArray:
    found = np.zeros(len(triangle))
    for ray in range(len(triangle)):
        a, b, c = triangles[triangle[ray], 0], triangles[triangle[ray], 1], triangles[triangle[ray], 2]
        found[ray] = values[a] + u[ray] * (values[b] - values[a]) + v[ray] * (values[c] - values[a])
    return found


def shade(
    hits: Hits,
    triangles: IntArray,
    vertex_normals: FloatArray,
    sky: FloatArray,
    colour: Floats,
    finish: tuple[bool, float, float],
    camera: Camera,
) -> tuple[Floats, Floats]:
    """Lit colours (n, 3) and opacities (n,).

    Ambient light dimmed by `sky` (vertices), a headlight, and a key light from above left behind the
    viewer with its reflection (Blinn 1977). `colour` is (n, 3) or (1, 3); `finish` is whether normals are
    smooth, the gloss and the opacity, which grows towards grazing angles.
    """
    key = -0.45 * camera.right + 0.75 * camera.up - 0.65 * camera.forward
    key /= np.linalg.norm(key)
    halfway = key - camera.forward
    halfway /= np.linalg.norm(halfway)
    return _shade(*hits[:4], triangles, vertex_normals, sky, colour, finish, camera.forward, key, halfway)


@compiled
def _shade(
    triangle: NDArray[np.int32],
    u: Floats,
    v: Floats,
    flat: Floats,
    triangles: IntArray,
    vertex_normals: FloatArray,
    sky: FloatArray,
    colour: Floats,
    finish: tuple[bool, float, float],
    forward: FloatArray,
    key: FloatArray,
    halfway: FloatArray,
) -> tuple[Floats, Floats]:
    smooth, gloss, opacity = finish
    lit, opacities = np.zeros((len(triangle), 3), np.float32), np.zeros(len(triangle), np.float32)
    for ray in range(len(triangle)):
        a, b, c = triangles[triangle[ray], 0], triangles[triangle[ray], 1], triangles[triangle[ray], 2]
        q, r = u[ray], v[ray]
        p = 1.0 - q - r
        x, y, z = float(flat[ray, 0]), float(flat[ray, 1]), float(flat[ray, 2])
        if smooth:
            x = p * vertex_normals[a, 0] + q * vertex_normals[b, 0] + r * vertex_normals[c, 0]
            y = p * vertex_normals[a, 1] + q * vertex_normals[b, 1] + r * vertex_normals[c, 1]
            z = p * vertex_normals[a, 2] + q * vertex_normals[b, 2] + r * vertex_normals[c, 2]
        length = np.sqrt(x * x + y * y + z * z) + 1e-30
        facing = -(x * forward[0] + y * forward[1] + z * forward[2]) / length
        if facing < 0.0:
            length, facing = -length, -facing
        ambient = p * sky[a] + q * sky[b] + r * sky[c]
        towards = 0.15 + 0.85 * (x * key[0] + y * key[1] + z * key[2]) / length
        mirror = (x * halfway[0] + y * halfway[1] + z * halfway[2]) / length
        light = _AMBIENT * ambient + _KEY * min(max(towards, 0.0), 1.0) * (0.4 + 0.6 * ambient) + _HEAD * facing
        shine = gloss * max(mirror, 0.0) ** _SHARPNESS
        row = ray if len(colour) > 1 else 0
        for channel in range(3):
            lit[ray, channel] = colour[row, channel] * light + shine
        opacities[ray] = opacity
        if opacity < 1.0:
            opacities[ray] = opacity + 0.7 * (1.0 - opacity) * (1.0 - facing) ** 3
    return lit, opacities
