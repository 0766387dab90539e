"""How much of the surrounding light reaches a surface: ambient occlusion at the vertices."""

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from glisson.core.arrays import FloatArray
from glisson.geometry.normals import vertex_normals
from glisson.navigation.rendering.bodies import Body

_RAYS = 32
_REACH_MM = 60.0
_OFF_SURFACE_MM = 0.2


def ambient_light(bodies: list[Body]) -> list[FloatArray]:
    """For each body the light (n,) at its vertices, 1 under a free sky, towards 0 in crevices.

    Rays over the hemisphere are dimmed by what they meet within 60 mm, less the farther it is. Bodies
    inside another one are taken as lit through it, without occlusion.
    """
    scene = EmbreeScene()
    for body in bodies:
        if not body.inner:
            TriangleMesh(scene, body.vertices.astype(np.float32), body.triangles.astype(np.int32))
    return [np.ones(len(body.vertices)) if body.inner else _free_sky(body, scene) for body in bodies]


def _free_sky(body: Body, scene: EmbreeScene) -> FloatArray:
    """The freer of both sides counts, since flat bodies (board, plane) have no inside."""
    normals = vertex_normals(body.vertices, body.triangles)
    directions = _hemisphere(_RAYS)
    free = np.zeros((2, len(normals)))
    for side, facing in enumerate((normals, -normals)):
        seed = np.eye(3)[np.argmin(np.abs(facing), axis=1)]
        u = np.cross(seed, facing)
        u /= np.linalg.norm(u, axis=1, keepdims=True)
        frame = np.stack([u, np.cross(facing, u), facing], axis=1)
        rays = np.einsum("dk,nkx->ndx", directions, frame).reshape(-1, 3).astype(np.float32)
        starts = np.repeat(body.vertices + _OFF_SURFACE_MM * facing, _RAYS, axis=0).astype(np.float32)
        distance = scene.run(starts, rays, query="DISTANCE").reshape(-1, _RAYS)
        free[side] = np.clip(distance / _REACH_MM, 0.0, 1.0).mean(axis=1)
        if body.smooth:
            break  # closed: its inside is not seen
    freer: FloatArray = free.max(axis=0)
    return freer


def _hemisphere(count: int) -> FloatArray:
    """Directions (count, 3) over the hemisphere about +z, as dense as the cosine of their angle to it."""
    number = np.arange(count) + 0.5
    radius, angle = np.sqrt(number / count), number * np.pi * (1.0 + np.sqrt(5.0))
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1.0 - radius**2)], axis=1)
