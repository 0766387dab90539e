"""Ligaments that give way: springs spread over a part of the surface."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.model import Model
from glisson.mechanics.faces import exact_rule, face_nodes, face_values
from glisson.mechanics.parts import Memoryless


class ElasticAttachments(Memoryless):
    """A `Part`: faces whose corners all belong to a node set are drawn back to where they are in A.

    What they bear in A, where the organ hangs on them, they go on bearing; see `settle`.

    Args:
        model: its mesh, node sets and ligaments.
    """

    def __init__(self, model: Model) -> None:
        self._scanned = model.mesh.nodes
        faces = face_nodes(model.mesh)
        corners = model.mesh.nodes[faces[:, :3]]
        crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        stiffness = np.zeros(len(faces))
        for name, value in model.ligaments.items():
            stiffness += value * _within(faces, model.node_set(name), len(model.mesh.nodes))
        springs = 0.5 * stiffness * np.linalg.norm(crossed, axis=1)
        self._faces = faces[springs > 0.0]
        points, weights = exact_rule()
        values = face_values(points, model.mesh.is_quadratic)
        shares = np.einsum("q,qa,qb->ab", weights, values, values)
        self._springs = springs[springs > 0.0][:, None, None] * shares
        self._borne = np.zeros_like(self._scanned)

    def settle(self, unbalanced: FloatArray) -> None:
        """Bear in A what is left (n, 3) in mN of all other forces on their nodes."""
        nodes = np.unique(self._faces)
        self._borne[nodes] = -unbalanced[nodes]

    def energy(self, positions: FloatArray) -> float:
        """½ k ∫ |u|² dA, less the work of what they bear, in µJ."""
        away = self._away(positions)
        stretched = 0.5 * float(np.einsum("fab,fai,fbi->", self._springs, away, away))
        return stretched - float(np.vdot(self._borne, positions - self._scanned))

    def forces(self, positions: FloatArray) -> FloatArray:
        """What they bear and −k u over the faces, as nodal forces (n, 3) in mN."""
        forces = self._borne.copy()
        np.add.at(forces, self._faces, -np.einsum("fab,fbi->fai", self._springs, self._away(positions)))
        return forces

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """The springs, always definite."""
        local: FloatArray = self._springs[..., None, None] * np.eye(3)
        return self._faces, local

    def _away(self, positions: FloatArray) -> FloatArray:
        away: FloatArray = positions[self._faces] - self._scanned[self._faces]
        return away


def _within(faces: IntArray, nodes: IntArray, count: int) -> NDArray[np.bool_]:
    """Which faces have all corners among the nodes."""
    inside = np.zeros(count, dtype=bool)
    inside[nodes] = True
    result: NDArray[np.bool_] = np.all(inside[faces[:, :3]], axis=1)
    return result
