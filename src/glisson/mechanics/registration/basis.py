"""Displacements of an elastic body whose surface is moved at a few control points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.model import Model
from glisson.core.status import Status
from glisson.geometry.quadratic import straight_boundary
from glisson.geometry.spreading import evenly_spread
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.linear_solvers import make_direct_solver
from glisson.mechanics.loads import fixed_unknowns
from glisson.mechanics.pattern import FreeSystem, Stiffness, block_pattern


@dataclass(frozen=True, eq=False)
class ElasticModes:
    """Displacements Φ (n, 3, k), each of a root mean square of 1 mm, the softest first.

    `energies_uj` (k,) is the strain energy of each; different ones have none in common.
    """

    basis: FloatArray
    energies_uj: FloatArray


def boundary_responses(model: Model, count: int, held: Sequence[str] = ()) -> ElasticModes:
    """Linear elastic responses at rest to the motion of control nodes that are spread evenly over the surface.

    Args:
        model: the organ.
        count: of the control nodes.
        held: node sets that stay where they are; without any the modes are free of rigid motion.

    Raises:
        StageFailed: the body falls apart.
    """
    mesh = model.mesh
    triangles, _ = straight_boundary(mesh)
    fixed = fixed_unknowns(model, tuple(held))
    surface = np.setdiff1d(triangles, np.flatnonzero(fixed.any(axis=1)))
    controls = surface[evenly_spread(mesh.nodes[surface], count)]
    elasticity = Elasticity(mesh, model.materials, mesh.nodes)
    pattern = block_pattern(mesh.tetrahedra, len(mesh.nodes))
    blocks = np.zeros((pattern.block_count, 3, 3))
    elasticity.add_stiffness(mesh.nodes, pattern, blocks, project=True)
    fixed[controls] = True
    system = FreeSystem(pattern, fixed)
    solver = make_direct_solver()
    matrix = csr_array(pattern.matrix(blocks))
    try:
        if not solver.factor(Stiffness(pattern, system, blocks, mesh.nodes)):
            raise StageFailed("The mesh hangs together too loosely to respond to its surface.", Status.SINGULAR)
        basis = np.zeros((len(mesh.nodes), 3, 3 * len(controls)))
        for column in range(basis.shape[2]):
            pulled = np.zeros((len(mesh.nodes), 3))
            pulled[controls[column // 3], column % 3] = 1.0
            load = -(matrix @ pulled.ravel()).reshape(-1, 3)
            load[fixed] = 0.0
            answer = solver.solve(load, 0.0)
            assert answer is not None  # a direct solver has factored it
            basis[:, :, column] = pulled + answer
    finally:
        solver.close()
    flat = basis.reshape(-1, basis.shape[2])
    # Six of no energy are the rigid motions of what is not held, of which a motion has its own unknowns.
    return elastic_modes(basis, flat.T @ (matrix @ flat), rigid=0 if len(held) else 6)


def elastic_modes(basis: FloatArray, stiffness: FloatArray, rigid: int = 0) -> ElasticModes:
    """Modes of a basis (n, 3, k) with the strain energy ½ aᵀ S a, but for the `rigid` softest."""
    flat = basis.reshape(-1, basis.shape[2])
    values, vectors = eigh(stiffness, flat.T @ flat / len(basis))
    return ElasticModes(basis @ vectors[:, rigid:], 0.5 * values[rigid:])
