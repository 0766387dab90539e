"""A liver of the phantom family before a laparoscope: its triangles are the exact truth."""

import numpy as np
import trimesh

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TriangleSurface
from glisson.phantom.laparoscope_view import Place
from glisson.phantom.liver_shape import build_shape
from glisson.phantom.proportions import draw_proportions
from glisson.phantom.solid_surface import solid_surface
from glisson.phantom.texture import Mottle

_STEP_MM = 2.5
_LIVER = np.array([0.55, 0.22, 0.17])


class TriangleScene:
    """Triangles with a mottled colour (see `glisson.phantom.laparoscope_view.Surface`)."""

    def __init__(self, surface: TriangleSurface, colour: FloatArray = _LIVER, seed: int = 0) -> None:
        self.surface = surface
        self._mesh = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
        self._corners = np.asarray(surface.vertices)[np.asarray(surface.triangles)]
        faces = np.cross(self._corners[:, 1] - self._corners[:, 0], self._corners[:, 2] - self._corners[:, 0])
        self._faces = faces / np.linalg.norm(faces, axis=1, keepdims=True)
        self._smooth = np.asarray(self._mesh.vertex_normals)
        self._mottle, self._colour = Mottle(8.0, 4, seed), colour

    def hits(self, origin: FloatArray, rays: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Distances and smooth normals: a triangle is found in single precision, the distance to its plane is exact."""
        found = self._mesh.ray.intersects_first(np.tile(origin, (len(rays), 1)), rays)
        far, normals = np.full(len(rays), np.inf), np.zeros_like(rays)
        met = np.flatnonzero(found >= 0)
        plane = self._faces[found[met]]
        far[met] = ((self._corners[found[met], 0] - origin) * plane).sum(axis=1) / (rays[met] * plane).sum(axis=1)
        points = origin + far[met, None] * rays[met]
        shares = _shares(self._corners[found[met]], plane, points)
        mixed = (self._smooth[self.surface.triangles[found[met]]] * shares[:, :, None]).sum(axis=1)
        normals[met] = mixed / np.linalg.norm(mixed, axis=1, keepdims=True)
        return far, normals

    def colours(self, points_mm: FloatArray) -> FloatArray:
        """The colour, lighter and darker from spot to spot."""
        shade = 0.8 + 1.4 * (self._mottle.at(points_mm) - 0.5)
        painted: FloatArray = self._colour * shade[:, None]
        return painted


def _shares(corners: FloatArray, normals: FloatArray, points: FloatArray) -> FloatArray:
    """Of each corner's value how much counts at points (n, 3) in triangles (n, 3, 3): areas over the whole."""
    opposite = [
        np.cross(corners[:, (k + 2) % 3] - corners[:, (k + 1) % 3], points - corners[:, (k + 1) % 3]) for k in range(3)
    ]
    areas = np.stack([(part * normals).sum(axis=1) for part in opposite], axis=1)
    shares: FloatArray = areas / areas.sum(axis=1, keepdims=True)
    return shares


def liver_scene(member: int) -> TriangleScene:
    """The liver of a member of the phantom family in its rest shape, in its own frame (LPS mm) as the room's."""
    return TriangleScene(solid_surface(build_shape(draw_proportions(member)).liver, _STEP_MM), seed=member)


def places_about(target_mm: FloatArray, distance_mm: float, angles_deg: FloatArray) -> list[Place]:
    """Scopes before (anterior of) a point (3,), all aimed at it, turned about the body's long axis."""
    places = []
    for angle in np.radians(angles_deg):
        away = np.array([np.sin(angle), -np.cos(angle), 0.0])
        right, down = np.cross([0.0, 0.0, -1.0], -away), np.array([0.0, 0.0, -1.0])
        places.append(Place(np.column_stack([right, down, -away]), target_mm + distance_mm * away))
    return places
