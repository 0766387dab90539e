"""A rigid tool that presses on the reduced organ: found on candidates of the surface, felt by the modes."""

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.geometry.compiled import compiled
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.elements import SurfaceQuadrature
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.local import LocalCompliance, Pulled, turn_of
from glisson.mechanics.reduced.pressing import Pressing

_REACH_MM = 12.0  # gap within which surface nodes of the last state are candidates …
_PUSHED_MM = 3.0  # … and within which they may give way beyond the modes
_LEAST = 1e-8  # compliance in mm/mN, where the modes leave nothing


@dataclass(frozen=True, eq=False)
class ReducedSurface:
    """The surface in the modes: nodes' `rest` (s, 3) in mm and `basis` (s, 3, r), and quadrature points over them.

    Every face (f, 3 or 6) of `faces` has the points `shapes` (q, 3 or 6), with `areas` (f, q) in mm². `local` (s,) are
    the nodes' numbers in a `LocalCompliance`, −1 where tools don't reach.
    """

    rest: FloatArray
    basis: FloatArray
    faces: IntArray
    shapes: FloatArray
    areas: FloatArray
    local: IntArray

    def positions(self, modal: FloatArray) -> FloatArray:
        """Positions (s, 3) of the surface's nodes."""
        result: FloatArray = self.rest + self.basis @ modal
        return result

    def in_modes(self, count: int) -> "ReducedSurface":
        """In the first of its modes."""
        return replace(self, basis=np.ascontiguousarray(self.basis[:, :, :count]))


def reduced_surface(mesh: TetMesh, surface: SurfaceQuadrature, basis: FloatArray, reach: IntArray) -> ReducedSurface:
    """The surface of a mesh whose points come face by face, as many on each; tools reach the nodes `reach` (k,)."""
    count = len(mesh.boundary()[0])
    points = len(surface.areas) // count
    faces = surface.nodes[::points]
    used, numbered = np.unique(faces, return_inverse=True)
    areas = surface.areas.reshape(count, points)
    local = np.full(len(mesh.nodes), -1)
    local[np.unique(reach)] = np.arange(len(np.unique(reach)))
    on_modes = np.ascontiguousarray(basis[used])
    return ReducedSurface(
        mesh.nodes[used], on_modes, numbered.reshape(faces.shape), surface.shapes[:points], areas, local[used]
    )


class ReducedContact:
    """The tool of a load against candidates of the surface, whose unknowns (r + c,) are modes and pushes.

    Pushes are forces in mN on c nodes next to the tool, along its normals where it was first met; what they move beyond
    the modes is the local compliance's.

    Args:
        surface: the whole of it.
        local: how it gives way beyond the modes.
        load: with a tool.
        cushion: between both.
        modal: (r,) state near which candidates are looked for.
        pulled: what else moves the surface beyond the modes.
    """

    def __init__(
        self,
        surface: ReducedSurface,
        local: LocalCompliance,
        load: Load,
        cushion: Cushion,
        modal: FloatArray,
        pulled: Pulled,
    ) -> None:
        pressing = Pressing.of(load, cushion)
        assert pressing is not None  # asked for only where there is a tool
        self._pressing, self._shapes = pressing, surface.shapes
        places = surface.positions(modal)
        gaps = pressing.gaps(places)
        candidates = np.flatnonzero((gaps < _REACH_MM)[surface.faces].any(axis=1))
        nodes, numbered = np.unique(surface.faces[candidates], return_inverse=True)
        self._faces = numbered.reshape(len(candidates), surface.faces.shape[1])
        self._nodes, self._rest, self._areas = nodes, surface.rest[nodes], surface.areas[candidates]
        corners = self._rest[self._faces]
        self._size = 1.5 * float(np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(initial=0.0))
        reached = surface.local[nodes]
        self._unreached = reached < 0
        pushed = np.flatnonzero((gaps[nodes] < _PUSHED_MM) & (reached >= 0))
        self.turn = turn_of(self._rest, places[nodes])
        self.pushed = reached[pushed]
        """Numbers (c,) of the pushed nodes in the local compliance."""
        self.normals, _ = pressing.derivatives(places[nodes[pushed]])
        rows = np.flatnonzero(reached >= 0)
        moved = np.zeros((len(nodes), 3, len(pushed)))
        moved[rows] = _moved(local.compliance, reached[rows], self.pushed, self.normals, self.turn)
        self._rest[rows] += pulled.displacement(self.turn, local.nodes[reached[rows]])
        self._moved = moved
        self._basis = np.concatenate([surface.basis[nodes], moved], axis=2)
        self.compliance = np.einsum("ci,cid->cd", self.normals, moved[pushed]) + _LEAST * np.eye(len(pushed))
        """Of pushes against each other (c, c), in mm/mN."""
        self._last: tuple[FloatArray, _Touching] | None = None

    def in_modes(self, surface: ReducedSurface, unknowns: FloatArray) -> "ReducedContact":
        """The same on a surface in more modes, at unknowns (R + c,) that leave it where it is."""
        other = copy(self)
        other._last = None if self._last is None else (unknowns, self._last[1])
        other._basis = np.concatenate([surface.basis[self._nodes], self._moved], axis=2)
        return other

    def energy(self, unknowns: FloatArray) -> float:
        """In µJ."""
        touching = self._touching(unknowns)
        return self._pressing.energy(touching.gaps, touching.areas)

    def forces(self, unknowns: FloatArray) -> FloatArray:
        """Force of the tool on the unknowns (r + c,)."""
        nodal = self._nodal(unknowns)
        used = np.flatnonzero(nodal.any(axis=1))
        result: FloatArray = nodal[used].ravel() @ self._basis[used].reshape(-1, self._basis.shape[2])
        return result

    def unknown_force(self, unknowns: FloatArray) -> float:
        """Force in mN on nodes where it is not known how they give way."""
        return float(np.linalg.norm(self._nodal(unknowns)[self._unreached], axis=1).sum())

    def depth_mm(self, unknowns: FloatArray) -> float:
        """How deep the tool is in the surface."""
        return float(-self._touching(unknowns).gaps.min(initial=0.0))

    def _nodal(self, unknowns: FloatArray) -> FloatArray:
        """Forces of the tool on the candidates' nodes (m, 3)."""
        touching = self._touching(unknowns)
        pushes = (touching.areas * self._pressing.cushion.pressure(touching.gaps))[:, None] * touching.normals
        nodal = np.zeros_like(self._rest)
        np.add.at(nodal, touching.nodes, touching.shapes[:, :, None] * pushes[:, None, :])
        return nodal

    def stiffness(self, unknowns: FloatArray, project: bool) -> FloatArray:
        """∂² of the energy by the unknowns (r + c, r + c)."""
        touching, size = self._touching(unknowns), self._basis.shape[2]
        basis = _at_points(touching.shapes, touching.nodes, self._basis)
        if project:
            slopes = touching.areas * self._pressing.cushion.slope(touching.gaps)
            along = (touching.normals[:, None, :] @ basis)[:, 0]
            return along.T @ (slopes[:, None] * along)
        local = self._pressing.stiffness(touching.gaps, touching.areas, touching.normals, touching.curvatures)
        result: FloatArray = basis.reshape(-1, size).T @ (local @ basis).reshape(-1, size)
        return result

    def _touching(self, unknowns: FloatArray) -> "_Touching":
        """The surface points on which the tool presses; those of the last unknowns are kept."""
        if self._last is not None and self._last[0] is unknowns:
            return self._last[1]
        nodes = self._rest + self._basis @ unknowns
        near = self._pressing.gaps(nodes) < self._pressing.cushion.range_mm + self._size
        faces = np.flatnonzero(near[self._faces].any(axis=1))
        points = (self._shapes @ nodes[self._faces[faces]]).reshape(-1, 3)
        gaps = self._pressing.gaps(points)
        pressed = self._pressing.near(gaps)
        face, kind = np.divmod(pressed, len(self._shapes))
        rows = faces[face]
        areas, shapes = self._areas[rows, kind], self._shapes[kind]
        normals, curvatures = self._pressing.derivatives(points[pressed])
        touching = _Touching(gaps[pressed], areas, normals, curvatures, self._faces[rows], shapes)
        self._last = (unknowns, touching)
        return touching


@dataclass(frozen=True, eq=False)
class _Touching:
    """Points with gaps (p,) in mm and areas (p,) in mm², the tool's normals (p, 3) and curvatures (p, 3, 3) there.

    `nodes` (p, a) are those of their faces, with `shapes` (p, a).
    """

    gaps: FloatArray
    areas: FloatArray
    normals: FloatArray
    curvatures: FloatArray
    nodes: IntArray
    shapes: FloatArray


@compiled
def _at_points(shapes: FloatArray, nodes: IntArray, basis: FloatArray) -> FloatArray:
    """The basis (m, 3, r) of nodes at points (p, 3, r) whose faces' nodes (p, a) have shares (p, a)."""
    result = np.zeros((len(nodes), 3, basis.shape[2]))
    for p in range(len(nodes)):
        for a in range(nodes.shape[1]):
            for i in range(3):
                for r in range(basis.shape[2]):
                    result[p, i, r] += shapes[p, a] * basis[nodes[p, a], i, r]
    return result


@compiled
def _moved(
    compliance: FloatArray, rows: IntArray, pushed: IntArray, normals: FloatArray, turn: FloatArray
) -> FloatArray:
    """Displacements (m, 3, c) of the nodes `rows` (m,) by unit pushes along the normals (c, 3)."""
    moved = np.zeros((len(rows), 3, len(pushed)))
    for d in range(len(pushed)):
        force = turn.T @ normals[d]
        for c in range(len(rows)):
            for i in range(3):
                value = 0.0
                for j in range(3):
                    value += compliance[pushed[d], j, rows[c], i] * force[j]
                for k in range(3):
                    moved[c, k, d] += turn[k, i] * value
    return moved
