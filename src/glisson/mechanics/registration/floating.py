"""A linear elastic body that nothing holds, under forces that are balanced by its own inertia."""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import orth

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.mesh import TetMesh
from glisson.core.model import Model
from glisson.core.status import Status
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.linear_solvers import make_direct_solver
from glisson.mechanics.pattern import FreeSystem, Stiffness, block_pattern


class FloatingBody:
    """Displacements, without any rigid part, by forces whose resultant the body's accelerating mass balances.

    Args:
        model: the organ, at rest as scanned.

    Raises:
        StageFailed: the body falls apart.
    """

    def __init__(self, model: Model) -> None:
        mesh = model.mesh
        self.elasticity = Elasticity(mesh, model.materials, mesh.nodes)
        pattern = block_pattern(mesh.tetrahedra, len(mesh.nodes))
        blocks = np.zeros((pattern.block_count, 3, 3))
        self.elasticity.add_stiffness(mesh.nodes, pattern, blocks, project=True)
        self._solver = make_direct_solver()
        if not self._solver.factor(Stiffness(pattern, FreeSystem(pattern, _three_points(mesh)), blocks, mesh.nodes)):
            raise StageFailed("The mesh hangs together too loosely to be deformed.", Status.SINGULAR)
        self._rigid: FloatArray = rigid_motions(mesh.nodes)
        heavy = np.repeat(_shares_of_volume(mesh), 3)[:, None] * self._rigid
        # Accelerating with that, the body's mass takes up what forces would move it by.
        self._inertia: FloatArray = heavy @ np.linalg.inv(self._rigid.T @ heavy)

    def response(self, forces: FloatArray) -> FloatArray:
        """Displacements (n, 3) by forces (n, 3) in mN; they have no mean motion and no mean rotation."""
        flat = forces.ravel()
        balanced = flat - self._inertia @ (self._rigid.T @ flat)
        answer = self._solver.solve(balanced.reshape(-1, 3), 0.0)
        assert answer is not None  # a direct solver has factored it
        moved = answer.ravel()
        still: FloatArray = (moved - self._rigid @ (self._rigid.T @ moved)).reshape(-1, 3)
        return still

    def close(self) -> None:
        """Give the factor's memory back."""
        self._solver.close()


def rigid_motions(nodes: FloatArray) -> FloatArray:
    """An orthonormal basis (3 n, 6) of the small rigid motions of nodes (n, 3)."""
    arms = nodes - nodes.mean(axis=0)
    turns = np.cross(np.eye(3)[None], arms[:, None, :]).transpose(0, 2, 1)
    shifts = np.tile(np.eye(3), (len(nodes), 1, 1))
    basis: FloatArray = orth(np.concatenate([shifts, turns / np.abs(arms).max()], axis=2).reshape(-1, 6))
    return basis


def _three_points(mesh: TetMesh) -> NDArray[np.bool_]:
    """Six unknowns (n, 3) without which a body cannot move rigidly and yet is free to deform."""
    corners = np.unique(mesh.corners)
    places = mesh.nodes[corners]
    first = int(np.linalg.norm(places - places.mean(axis=0), axis=1).argmax())
    arms = places - places[first]
    second = int(np.linalg.norm(arms, axis=1).argmax())
    normals = np.cross(arms[second], arms)
    third = int(np.linalg.norm(normals, axis=1).argmax())
    fixed = np.zeros(mesh.nodes.shape, dtype=np.bool_)
    fixed[corners[first]] = True
    fixed[corners[second]] = np.arange(3) != np.abs(arms[second]).argmax()
    fixed[corners[third], np.abs(normals[third]).argmax()] = True
    return fixed


def _shares_of_volume(mesh: TetMesh) -> FloatArray:
    """The part (n,) of the volume around each corner node, mm³."""
    shares: FloatArray = np.zeros(len(mesh.nodes))
    np.add.at(shares, mesh.corners, mesh.corner_volumes_mm3[:, None] / 4.0)
    return shares
