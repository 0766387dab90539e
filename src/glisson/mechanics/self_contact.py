"""The organ's contact with itself, by the barrier of the IPC Toolkit (Li et al. 2020, Incremental Potential Contact).

Without friction. A state in which the surface cuts itself has infinite energy, so that no line search takes it. The way
to a state is not looked at: a part thinner than a step could pass through another one within it.
"""

from importlib.util import find_spec
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.mechanics.faces import face_nodes
from glisson.mechanics.node_pairs import node_pairs
from glisson.mechanics.parts import Memoryless

_STIFFNESS_KPA = 200.0  # of the barrier, far above the pressure of an organ's weight (0.5 kPa)
_STIFFNESS_MODULI = 3.0
_QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])  # of a face with six nodes


class SelfContact(Memoryless):
    """A `Part`: pieces of the surface that come nearer than `range_mm` push each other away.

    Args:
        mesh: the organ in A; faces of T10 elements count as four triangles.
        range_mm: where the barrier begins.
        stiffest_kpa: largest Young's modulus.

    Raises:
        BadInput: the IPC Toolkit is not installed, or the surface cuts itself in A.
    """

    def __init__(self, mesh: TetMesh, range_mm: float, stiffest_kpa: float) -> None:
        if find_spec("ipctk") is None:
            raise BadInput("Self-contact needs the package ipctk: pip install 'glisson[self-contact]'.")
        import ipctk  # optional

        self._ipctk: Any = ipctk
        faces = face_nodes(mesh)
        triangles = faces[:, _QUARTERS].reshape(-1, 3) if mesh.is_quadratic else faces
        self._nodes, local = np.unique(triangles, return_inverse=True)
        local = np.asfortranarray(local.reshape(-1, 3).astype(np.int32))
        self._surface = ipctk.CollisionMesh(self._taken(mesh.nodes), ipctk.edges(local), local)
        self._range = range_mm
        stiffness = max(_STIFFNESS_KPA, _STIFFNESS_MODULI * stiffest_kpa)
        self._barrier = ipctk.BarrierPotential(range_mm, stiffness, use_physical_barrier=True)
        if ipctk.has_intersections(self._surface, self._taken(mesh.nodes)):
            raise BadInput(
                "The organ's surface cuts itself in the scanned shape; repair it, or leave self_contact off."
            )

    def energy(self, positions: FloatArray) -> float:
        """The barrier's potential in µJ; infinite where the surface cuts itself."""
        places = self._taken(positions)
        if self._ipctk.has_intersections(self._surface, places):
            return float("inf")
        return float(self._barrier(self._collisions(places), self._surface, places))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (n, 3) in mN."""
        places = self._taken(positions)
        forces = np.zeros_like(positions)
        gradient = self._barrier.gradient(self._collisions(places), self._surface, places)
        forces[self._nodes] = -np.asarray(gradient).reshape(-1, 3)
        return forces

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """Pairs of nodes (k, 2) that push each other, or a node with itself."""
        places = self._taken(positions)
        method = self._ipctk.PSDProjectionMethod.CLAMP if project else self._ipctk.PSDProjectionMethod.NONE
        hessian = self._barrier.hessian(self._collisions(places), self._surface, places, method)
        return node_pairs(hessian, self._nodes)

    def _taken(self, positions: FloatArray) -> FloatArray:
        """The surface's nodes, as the toolkit wants them."""
        return np.asfortranarray(positions[self._nodes])

    def _collisions(self, places: FloatArray) -> Any:
        collisions = self._ipctk.NormalCollisions()
        collisions.use_area_weighting = True
        collisions.build(self._surface, places, self._range)
        return collisions
