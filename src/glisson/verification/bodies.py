"""Bodies for verification: boxes of tetrahedra, and mechanical systems without a scenario."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.tools import Board
from glisson.mechanics.body import Body
from glisson.mechanics.contact import ToolContact
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import surface_quadrature
from glisson.mechanics.gas_pressure import GasPressure
from glisson.mechanics.linear_solvers import make_direct_solver
from glisson.mechanics.newton import Newton, NewtonEnd, NewtonSettings
from glisson.mechanics.parts import Part
from glisson.mechanics.tools import RigidTool, make_tool
from glisson.verification.check import NoSolution

LAWS = (
    "linear-elastic",
    "co-rotational",
    "saint-venant-kirchhoff",
    "neo-hookean",
    "neo-hookean-log",
    "mooney-rivlin",
    "ogden",
)
FRAME_INDIFFERENT = LAWS[1:]
_CONSTANTS = {"mooney-rivlin": (0.3,), "ogden": (1.6, 0.8, -2.5, 0.2)}


def material_of(law: str, young_modulus_kpa: float = 7.0, poisson_ratio: float = 0.45) -> Material:
    """A material of that law, with constants where it needs some."""
    return Material(law, young_modulus_kpa, poisson_ratio, constants=_CONSTANTS.get(law, ()))


def mapped(mesh: TetMesh, place: Callable[[FloatArray], FloatArray]) -> TetMesh:
    """The mesh with all its nodes (n, 3), middle ones too, taken elsewhere (n, 3)."""
    return TetMesh(place(mesh.nodes), mesh.tetrahedra, mesh.regions)


def distorted(mesh: TetMesh, amount: float, seed: int = 0) -> TetMesh:
    """The mesh with its inner nodes moved at random, so that no symmetry hides a slip (T4 in, T4 out)."""
    rng = np.random.default_rng(seed)
    inner = np.ones(len(mesh.nodes), dtype=bool)
    inner[np.unique(mesh.boundary()[0])] = False
    nodes = mesh.nodes.copy()
    nodes[inner] += rng.uniform(-amount, amount, (int(inner.sum()), 3))
    return TetMesh(nodes, mesh.tetrahedra, mesh.regions)


def box_model(mesh: TetMesh, material: Material, **node_sets: IntArray) -> Model:
    """A model of one region."""
    return Model(mesh, {0: material}, {0: "box"}, node_sets)


def body_of(
    mesh: TetMesh,
    material: Material,
    fixed: NDArray[np.bool_] | None = None,
    boards: Sequence[Board] = (),
    cushion: Cushion | None = None,
    stick_mm: float = 0.005,
    tools: Sequence[RigidTool] = (),
    parts: Sequence[Part] = (),
    gas: GasPressure | None = None,
) -> Body:
    """A mechanical system of one material, on boards and other tools, with parts and in a gas."""
    surface = surface_quadrature(mesh.nodes, mesh)
    cushion = cushion or Cushion(0.1, 2000.0)
    everything = [*(make_tool(board) for board in boards), *tools]
    contacts = [ToolContact(tool, surface, cushion, stick_mm) for tool in everything]
    fixed = np.zeros(mesh.nodes.shape, dtype=bool) if fixed is None else fixed
    return Body(Elasticity(mesh, {0: material}, mesh.nodes), surface, contacts, fixed, parts, gas)


def floor(height: float = 0.0) -> Board:
    """A board whose organ lies above it."""
    return Board("floor", np.array([0.0, 0.0, height]), np.array([0.0, 0.0, 1.0]))


def solve(body: Body, positions: FloatArray, tolerance: float = 1e-9, limit: int = 100) -> NewtonEnd:
    """Newton's method from `positions` (n, 3), whatever its end."""
    newton = Newton(body, make_direct_solver(), NewtonSettings(tolerance, limit))
    try:
        return newton.solve(positions)
    finally:
        newton.close()


def equilibrium(body: Body, positions: FloatArray, tolerance: float = 1e-9, limit: int = 100) -> FloatArray:
    """Node positions (n, 3) in equilibrium near `positions`.

    Raises:
        NoSolution: Newton's method did not converge.
    """
    end = solve(body, positions, tolerance, limit)
    if not end.status.is_good:
        raise NoSolution(f"no equilibrium ({end.status}, residual {end.residual:.1e}) {end.reason}".rstrip())
    return end.positions


def reactions(body: Body, positions: FloatArray) -> FloatArray:
    """Forces (n, 3) in mN with which the held unknowns are held; zero elsewhere."""
    balance = body.balance(positions, body.touches(positions))
    forces = -(balance.internal + balance.contact + balance.external)
    return np.where(body.fixed, forces, 0.0)
