"""A rigid tool that presses on the reduced organ: found on candidates of the surface, felt by the modes."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.elements import SurfaceQuadrature
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.pressing import Pressing

_REACH_MM = 25.0  # within which surface nodes of the last state are candidates


@dataclass(frozen=True, eq=False)
class ReducedSurface:
    """The surface in the modes: nodes' `rest` (s, 3) in mm and `basis` (s, 3, r), and quadrature points over them.

    Every face (f, 3 or 6) of `faces` has the points `shapes` (q, 3 or 6), with `areas` (f, q) in mm².
    """

    rest: FloatArray
    basis: FloatArray
    faces: IntArray
    shapes: FloatArray
    areas: FloatArray

    def positions(self, modal: FloatArray) -> FloatArray:
        """Positions (s, 3) of the surface's nodes."""
        result: FloatArray = self.rest + self.basis @ modal
        return result


def reduced_surface(mesh: TetMesh, surface: SurfaceQuadrature, basis: FloatArray) -> ReducedSurface:
    """The surface of a mesh whose points come face by face, as many on each."""
    count = len(mesh.boundary()[0])
    points = len(surface.areas) // count
    faces = surface.nodes[::points]
    used, numbered = np.unique(faces, return_inverse=True)
    areas = surface.areas.reshape(count, points)
    return ReducedSurface(
        mesh.nodes[used], np.ascontiguousarray(basis[used]), numbered.reshape(faces.shape), surface.shapes[:points], areas
    )


class ReducedContact:
    """The tool of a load against candidates of the surface.

    Args:
        surface: the whole of it.
        load: with a tool.
        cushion: between both.
        modal: (r,) state near which candidates are looked for.
    """

    def __init__(self, surface: ReducedSurface, load: Load, cushion: Cushion, modal: FloatArray) -> None:
        pressing = Pressing.of(load, cushion)
        assert pressing is not None  # asked for only where there is a tool
        self._pressing, self._surface = pressing, surface
        near = pressing.gaps(surface.positions(modal)) < _REACH_MM
        candidates = np.flatnonzero(near[surface.faces].any(axis=1))
        nodes, numbered = np.unique(surface.faces[candidates], return_inverse=True)
        self._faces = numbered.reshape(len(candidates), -1)
        self._rest, self._basis = surface.rest[nodes], surface.basis[nodes]
        self._flat = self._basis.reshape(3 * len(nodes), self._basis.shape[2])
        self._areas = surface.areas[candidates]
        corners = self._rest[self._faces]
        self._size = 1.5 * float(np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(initial=0.0))

    def energy(self, modal: FloatArray) -> float:
        """In µJ."""
        _, _, gaps, areas = self._touching(modal)
        return self._pressing.energy(gaps, areas)

    def forces(self, modal: FloatArray) -> FloatArray:
        """Force of the tool on the modes (r,)."""
        faces, points, gaps, areas = self._touching(modal)
        pushes = self._pressing.pushes(points, gaps, areas).reshape(len(faces), len(self._surface.shapes), 3)
        nodal = np.zeros_like(self._rest)
        np.add.at(nodal, self._faces[faces], np.einsum("qa,fqi->fai", self._surface.shapes, pushes))
        result: FloatArray = nodal.ravel() @ self._flat
        return result

    def stiffness(self, modal: FloatArray, project: bool) -> FloatArray:
        """∂²/∂q² (r, r) of the energy."""
        faces, points, gaps, areas = self._touching(modal)
        shapes = self._surface.shapes
        local = self._pressing.stiffness(points, gaps, areas, project).reshape(len(faces), len(shapes), 3, 3)
        nodes, numbered = np.unique(self._faces[faces], return_inverse=True)
        numbered = numbered.reshape(len(faces), shapes.shape[1])
        blocks = np.einsum("qa,qb,fqij->faibj", shapes, shapes, local, optimize=True)
        rows = (3 * numbered[:, :, None] + np.arange(3)).reshape(len(faces), -1)
        matrix = np.zeros((3 * len(nodes), 3 * len(nodes)))
        size = rows.shape[1]
        np.add.at(matrix, (rows[:, :, None], rows[:, None, :]), blocks.reshape(len(faces), size, size))
        basis = self._basis[nodes].reshape(3 * len(nodes), self._basis.shape[2])
        result: FloatArray = basis.T @ (matrix @ basis)
        return result

    def _touching(self, modal: FloatArray) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
        """Faces (f,) near the tool, and positions (p, 3), gaps (p,) and areas (p,) of their points."""
        nodes = self._rest + self._basis @ modal
        near = self._pressing.gaps(nodes) < self._pressing.cushion.range_mm + self._size
        faces = np.flatnonzero(near[self._faces].any(axis=1))
        points = np.einsum("qa,fai->fqi", self._surface.shapes, nodes[self._faces[faces]]).reshape(-1, 3)
        return faces, points, self._pressing.gaps(points), self._areas[faces].ravel()
