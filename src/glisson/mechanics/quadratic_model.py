"""A model with quadratic elements instead of linear ones, and fields of one on the other."""

from dataclasses import replace

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TetMesh
from glisson.core.model import Model


def quadratic_model(model: Model) -> Model:
    """The model with T10 elements; a middle node belongs to a node set when both its ends do."""
    mesh = model.mesh.as_quadratic()
    if mesh is model.mesh:
        return model
    ends = mesh.corners[:, TET_EDGES].reshape(-1, 2)
    middles = mesh.tetrahedra[:, 4:].ravel()
    sets = {}
    for name, nodes in model.node_sets.items():
        inside = np.zeros(len(mesh.nodes), dtype=bool)
        inside[nodes] = True
        inside[middles[inside[ends].all(axis=1)]] = True
        sets[name] = np.flatnonzero(inside)
    return replace(model, mesh=mesh, node_sets=sets)


def linear_model(model: Model) -> tuple[Model, IntArray]:
    """The model with T4 elements, and the numbers (k,) that its nodes have in `model`."""
    mesh = model.mesh
    corners, renumbered = np.unique(mesh.corners, return_inverse=True)
    numbers = np.full(len(mesh.nodes), -1)
    numbers[corners] = np.arange(len(corners))
    linear = TetMesh(mesh.nodes[corners], renumbered.reshape(mesh.corners.shape), mesh.region_numbers)
    sets = {name: numbers[nodes][numbers[nodes] >= 0] for name, nodes in model.node_sets.items()}
    return replace(model, mesh=linear, node_sets=sets), corners


def with_middles(mesh: TetMesh, corners: IntArray, of_corners: FloatArray) -> FloatArray:
    """A field (n, 3) that is linear in a mesh's elements, from that (k, 3) of its nodes `corners` (k,)."""
    field = np.zeros_like(mesh.nodes)
    field[corners] = of_corners
    if not mesh.is_quadratic:
        return field
    ends = field[mesh.corners[:, TET_EDGES]]
    field[mesh.tetrahedra[:, 4:]] = 0.5 * (ends[:, :, 0] + ends[:, :, 1])
    return field
