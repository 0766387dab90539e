"""Simple bodies for verification: boxes of tetrahedra, their models and mechanical systems."""

import numpy as np

from glisson.core import Board, Material, Model, TetMesh
from glisson.mechanics.body import Body
from glisson.mechanics.contact import ToolContact
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import surface_quadrature
from glisson.mechanics.linear_solvers import make_direct_solver
from glisson.mechanics.newton import Newton, NewtonSettings
from glisson.mechanics.tools import make_tool

# Six tetrahedra around the diagonal 0-7 of a cube whose corner c sits at (c & 1, c >> 1 & 1, c >> 2 & 1).
_CUBE = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


def box_mesh(sizes, counts, quadratic=False) -> TetMesh:
    """A box from the origin, cut in `counts` cubes of six tetrahedra each."""
    counts = np.asarray(counts)
    axes = [np.linspace(0.0, size, count + 1) for size, count in zip(sizes, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, 3)
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    offsets = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])
    corners = (cells[:, None, :] + offsets) @ strides
    mesh = TetMesh(nodes, corners[:, _CUBE].reshape(-1, 4))
    return mesh.as_quadratic() if quadratic else mesh


def distorted(mesh: TetMesh, amount: float, seed: int = 0) -> TetMesh:
    """The mesh with its inner nodes moved at random, so that no symmetry hides a slip (T4 in, T4 out)."""
    rng = np.random.default_rng(seed)
    inner = np.ones(len(mesh.nodes), dtype=bool)
    inner[np.unique(mesh.boundary()[0])] = False
    nodes = mesh.nodes.copy()
    nodes[inner] += rng.uniform(-amount, amount, (int(inner.sum()), 3))
    return TetMesh(nodes, mesh.tetrahedra, mesh.regions)


def box_model(mesh: TetMesh, material: Material, **node_sets) -> Model:
    return Model(mesh, {0: material}, {0: "box"}, node_sets)


def body_of(mesh: TetMesh, material: Material, fixed=None, boards=(), cushion=None, stick_mm=0.005) -> Body:
    """A mechanical system without a scenario."""
    surface = surface_quadrature(mesh.nodes, mesh)
    cushion = cushion or Cushion(0.1, 2000.0)
    contacts = [ToolContact(make_tool(board), surface, cushion, stick_mm) for board in boards]
    fixed = np.zeros(mesh.nodes.shape, dtype=bool) if fixed is None else fixed
    return Body(Elasticity(mesh, {0: material}, mesh.nodes), surface, contacts, fixed)


def solve(body: Body, positions, tolerance=1e-9, limit=100):
    return Newton(body, make_direct_solver(), NewtonSettings(tolerance, limit)).solve(positions)


def floor(height: float = 0.0) -> Board:
    return Board("floor", np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 1.0]))
