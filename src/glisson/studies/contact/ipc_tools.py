"""Rigid tools by the IPC Toolkit (Li et al. 2020): triangles, a barrier, lagged friction."""

from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.geometry.quadratic import straight_boundary
from glisson.mechanics.node_pairs import node_pairs
from glisson.mechanics.tools import RigidTool

_RANGE_MM = 0.1  # of the barrier, as that of our cushion
_STIFFNESS_KPA = 200.0  # of the barrier, far above the pressure of an organ's weight (0.5 kPa)
_STIFFNESS_MODULI = 3.0
_STICK_MM = 0.02  # slip in a load step up to which friction is not fully mobilised


class IpcTools:
    """A `Part`. Friction acts against the motion since the last accepted step: a held body creeps a little with each.

    Args:
        mesh: the organ; faces of T10 elements count as four triangles.
        tools: where they are at an angle.
        surfaces: the tools' surfaces at angle 0.
        stiffest_kpa: largest Young's modulus.

    Raises:
        BadInput: the IPC Toolkit is not installed.
    """

    def __init__(
        self, mesh: TetMesh, tools: Sequence[RigidTool], surfaces: Sequence[TriangleSurface], stiffest_kpa: float
    ) -> None:
        if find_spec("ipctk") is None:
            raise BadInput("This study needs the package ipctk: pip install 'glisson[self-contact]'.")
        import ipctk  # optional

        self._ipctk: Any = ipctk
        self.friction = 0.0
        self.angles = [0.0] * len(tools)
        self._tools = tuple(tools)
        self._local = [_in_tool(tool, surface) for tool, surface in zip(tools, surfaces, strict=True)]
        faces, _ = straight_boundary(mesh)
        self._nodes, local = np.unique(faces, return_inverse=True)
        triangles, count = [local.reshape(-1, 3)], len(self._nodes)
        for surface in surfaces:
            triangles.append(surface.triangles + count)
            count += len(surface.vertices)
        joined = np.asfortranarray(np.vstack(triangles).astype(np.int32))
        self._start = self._places(mesh.nodes)
        self._mesh = ipctk.CollisionMesh(self._start, ipctk.edges(joined), joined)
        of_tools = np.arange(count) >= len(self._nodes)
        self._mesh.can_collide = ipctk.make_vertex_patches_filter(of_tools.astype(np.int32))
        stiffness = max(_STIFFNESS_KPA, _STIFFNESS_MODULI * stiffest_kpa)
        self._barrier = ipctk.BarrierPotential(_RANGE_MM, stiffness, use_physical_barrier=True)
        self._rubbing = ipctk.FrictionPotential(_STICK_MM)
        self._lagged: Any = ipctk.TangentialCollisions()
        self._last: tuple[FloatArray, Any] | None = None

    def energy(self, positions: FloatArray) -> float:
        """Potential in µJ; infinite where the organ cuts a tool."""
        places = self._places(positions)
        if self._ipctk.has_intersections(self._mesh, places):
            return float("inf")
        barrier = float(self._barrier(self._collisions(places), self._mesh, places))
        return barrier + float(self._rubbing(self._lagged, self._mesh, self._moved(places)))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (n, 3) in mN."""
        forces = np.zeros_like(positions)
        forces[self._nodes] = -self._gradient(positions)[: len(self._nodes)]
        return forces

    def on_tool(self, number: int, positions: FloatArray) -> FloatArray:
        """Force (3,) in mN of the organ on a tool."""
        first = len(self._nodes) + sum(len(local) for local in self._local[:number])
        force: FloatArray = -self._gradient(positions)[first : first + len(self._local[number])].sum(axis=0)
        return force

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """Pairs of nodes (k, 2) that one tool's triangle couples, or a node with itself."""
        places, method = self._places(positions), self._ipctk.PSDProjectionMethod
        projection = method.CLAMP if project else method.NONE
        hessian = self._barrier.hessian(self._collisions(places), self._mesh, places, projection)
        hessian = hessian + self._rubbing.hessian(self._lagged, self._mesh, self._moved(places), projection)
        size = 3 * len(self._nodes)
        return node_pairs(hessian[:size, :size], self._nodes)

    def renew(self, positions: FloatArray) -> None:
        """Take friction's limits and directions from the present pressure."""
        places = self._places(positions)
        self._lagged = self._ipctk.TangentialCollisions()
        if self.friction > 0.0:
            self._lagged.build(self._mesh, places, self._collisions(places), self._barrier, self.friction)

    def accept(self, positions: FloatArray) -> None:
        """Count slip from here on."""
        self._start = self._places(positions)

    def memory(self) -> Any:
        """What a rejected step must put back."""
        return list(self.angles), self._start, self._lagged

    def recall(self, memory: Any) -> None:
        """Put it back."""
        angles, self._start, self._lagged = memory
        self.angles = list(angles)

    def _gradient(self, positions: FloatArray) -> FloatArray:
        """Of the potential by all vertices, those of the tools included."""
        places = self._places(positions)
        barrier = self._barrier.gradient(self._collisions(places), self._mesh, places)
        rubbing = self._rubbing.gradient(self._lagged, self._mesh, self._moved(places))
        return np.asarray(barrier + rubbing).reshape(-1, 3)

    def _places(self, positions: FloatArray) -> FloatArray:
        """All vertices, as the toolkit wants them."""
        places = [positions[self._nodes]]
        for tool, local, angle in zip(self._tools, self._local, self.angles, strict=True):
            rotation, translation = tool.pose(angle)
            places.append(local @ rotation.T + translation)
        return np.asfortranarray(np.vstack(places))

    def _moved(self, places: FloatArray) -> FloatArray:
        return np.asfortranarray(places - self._start)

    def _collisions(self, places: FloatArray) -> Any:
        """What is near; energy, forces and stiffness are mostly asked for at the same places."""
        if self._last is None or not np.array_equal(self._last[0], places):
            collisions = self._ipctk.NormalCollisions()
            collisions.use_area_weighting = True
            collisions.collision_set_type = self._ipctk.NormalCollisions.CollisionSetType.IMPROVED_MAX_APPROX
            collisions.build(self._mesh, places, _RANGE_MM)
            self._last = places, collisions
        return self._last[1]


def _in_tool(tool: RigidTool, surface: TriangleSurface) -> FloatArray:
    rotation, translation = tool.pose(0.0)
    places: FloatArray = (surface.vertices - translation) @ rotation
    return places
