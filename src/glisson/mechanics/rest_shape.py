"""The unloaded shape: the scan shows the organ already deformed by gravity and its supports.

Inverse elastostatics (Govindjee and Mihalic 1996): the deformed positions A are given, the unloaded
positions X are the unknowns. A board that carried the organ during the scan presses with what is needed to
keep its underside where the scan shows it: an almost rigid bed, on which the underside of X lies as that of
A does. The pressures found are handed to the contact by shifting each surface point's gap (`offsets`) so
that the forward model, with the same loads, is in equilibrium at A exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import StageFailed
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.status import Status
from glisson.core.tools import Board
from glisson.mechanics.body import scatter_blocks
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import SurfaceQuadrature, quadrature
from glisson.mechanics.inexact_newton import step_accuracy
from glisson.mechanics.linear_solvers import LinearSolver, make_iterative_solver
from glisson.mechanics.pattern import FreeSystem, Stiffness, block_pattern, pair_slots
from glisson.mechanics.unsymmetric import solve_near_symmetric

_ITERATION_LIMIT = 60
_LOOSEST = 0.03  # accuracy of a Newton step
_WEIGHT_SHARES = (0.25, 0.5, 0.75, 1.0)
_BED_STIFFNESS_SHARE = 10.0  # bed stiffness in Young's moduli per mm: a weight of 0.6 kPa sinks in by 0.01 mm
_FACING = -0.5  # a surface point lies on a board when its outward normal is turned this much towards it


@dataclass(frozen=True, eq=False)
class Support:
    """A board's surface points (k,) in A and their pressures (k,) in kPa, zero where they only touch."""

    points: IntArray
    pressures: FloatArray
    conforming: bool


@dataclass(frozen=True, eq=False)
class RestShape:
    """Unloaded node positions (n, 3) in mm, and how each board carried the organ in A."""

    positions: FloatArray
    supports: Mapping[str, Support]


@dataclass(frozen=True, eq=False)
class _Bed:
    """A board and the surface points that lie on it in A."""

    name: str
    normal: FloatArray
    points: IntArray
    stiffness: float
    conforming: bool


def find_rest_shape(
    mesh: TetMesh,
    materials: Mapping[int, Material],
    weights: FloatArray,
    boards: Sequence[Board],
    surface: SurfaceQuadrature,
    fixed: NDArray[np.bool_],
    surface_tolerance_mm: float,
    accuracy: float,
) -> RestShape:
    """The shape that `weights` (n, 3) in mN and the boards deform into the scanned one.

    `accuracy` is the residual over the weight at which it is found.

    Raises:
        StageFailed: no unloaded shape was found (the organ is too soft for its weight).
    """
    stiffest = max(material.young_modulus_kpa for material in materials.values())
    beds = [_bed(board, mesh, surface, surface_tolerance_mm, _BED_STIFFNESS_SHARE * stiffest) for board in boards]
    problem = _InverseProblem(mesh, materials, weights, beds, surface, fixed)
    positions = problem.solve(accuracy)
    supports = {bed.name: Support(bed.points, problem.pressures(bed, positions), bed.conforming) for bed in beds}
    return RestShape(positions, supports)


class _InverseProblem:
    """Residual, derivative and search for X.

    The derivative is not symmetric; the forward stiffness at (X, A), which is near it, preconditions.
    """

    def __init__(
        self,
        mesh: TetMesh,
        materials: Mapping[int, Material],
        weights: FloatArray,
        beds: Sequence[_Bed],
        surface: SurfaceQuadrature,
        fixed: NDArray[np.bool_],
    ) -> None:
        self._mesh, self._weights = mesh, weights
        self._elasticity = Elasticity(mesh, materials, mesh.nodes)
        self._beds, self._surface, self._fixed = beds, surface, fixed
        self._scanned_points = surface.positions(mesh.nodes)
        self._pattern = block_pattern(mesh.tetrahedra, len(mesh.nodes))
        self._system = FreeSystem(self._pattern, fixed)
        self._pairs = pair_slots(self._pattern, surface.nodes)
        self._share = 1.0

    def solve(self, accuracy: float) -> FloatArray:
        """X by Newton's method with backtracking on the residual; the weight comes on in steps where it must."""
        solver = make_iterative_solver()
        try:
            found = self._balanced(np.array(self._mesh.nodes), solver, accuracy)
            if found is None:
                found = np.array(self._mesh.nodes)
                for share in _WEIGHT_SHARES:
                    self._share = share
                    found = self._balanced(found, solver, accuracy)
                    if found is None:
                        raise self._too_soft()
        finally:
            solver.close()
        return found

    def _balanced(self, positions: FloatArray, solver: LinearSolver, accuracy: float) -> FloatArray | None:
        """X for the present share of the weight, started from another share's; None where none is found."""
        force = self._unbalanced(positions)
        goal, before = accuracy * self._share * float(np.linalg.norm(self._weights)), np.inf
        for _ in range(_ITERATION_LIMIT):
            size = float(np.linalg.norm(force))
            if size <= goal:
                return positions
            step = self._step(positions, force, solver, step_accuracy(size, before, goal, _LOOSEST))
            before = size
            found = None if step is None else self._search(positions, step, size)
            if found is None:
                return None
            positions, force = found
        return None

    def _too_soft(self) -> StageFailed:
        return StageFailed(
            f"No unloaded shape could be found (at {100 * self._share:.0f} % of the weight): the organ is too soft to "
            "carry its weight in the scanned shape; use a higher Young's modulus, more attachments, or "
            'rest_shape = "as-scanned".',
            Status.STAGNATED,
        )

    def pressures(self, bed: _Bed, positions: FloatArray) -> FloatArray:
        """Pressure (k,) in kPa of a board on its surface points."""
        pressures: FloatArray = bed.stiffness * np.maximum(self._sinking(bed, positions), 0.0)
        return pressures

    def _sinking(self, bed: _Bed, positions: FloatArray) -> FloatArray:
        away = self._surface.positions(positions)[bed.points] - self._scanned_points[bed.points]
        sinking: FloatArray = away @ bed.normal
        return sinking

    def _unbalanced(self, positions: FloatArray) -> FloatArray:
        elasticity = self._elasticity.unloaded_at(positions)
        force = self._share * self._weights - elasticity.forces(self._mesh.nodes)
        pushes = np.zeros((len(self._surface.areas), 3))
        for bed in self._beds:
            forces = self.pressures(bed, positions) * self._surface.areas[bed.points]
            pushes[bed.points] += forces[:, None] * bed.normal
        force += self._surface.scatter(pushes)
        force[self._fixed] = 0.0
        return force

    def _step(
        self, positions: FloatArray, force: FloatArray, solver: LinearSolver, accuracy: float
    ) -> FloatArray | None:
        """Newton's step (n, 3); None where the forward stiffness is not definite."""
        elasticity = self._elasticity.unloaded_at(positions)
        beds = self._bed_stiffness(positions)
        derivative = -beds
        for project in (False, True):
            stiffness = beds.copy()
            elasticity.add_stiffness(self._mesh.nodes, self._pattern, stiffness, project)
            if solver.factor(Stiffness(self._pattern, self._system, stiffness, self._mesh.nodes)):
                break
        else:
            return None
        elasticity.add_rest_derivative(self._mesh.nodes, self._pattern, derivative)
        matrix = Stiffness(self._pattern, self._system, -derivative, self._mesh.nodes)
        return solve_near_symmetric(matrix, solver, -force, accuracy)

    def _bed_stiffness(self, positions: FloatArray) -> FloatArray:
        """Blocks (b, 3, 3) of the beds."""
        blocks = np.zeros((self._pattern.block_count, 3, 3))
        for bed in self._beds:
            pressed = bed.points[self._sinking(bed, positions) >= 0.0]  # all of them in A, where the search starts
            local = (bed.stiffness * self._surface.areas[pressed])[:, None, None] * np.outer(bed.normal, bed.normal)
            scatter_blocks(pressed, local, self._surface.shapes, self._pairs, blocks)
        return blocks

    def _search(self, positions: FloatArray, step: FloatArray, size: float) -> tuple[FloatArray, FloatArray] | None:
        for halving in range(12):
            moved = positions + 0.5**halving * step
            if float(quadrature(moved, self._mesh).weights.min()) <= 0.0:
                continue
            force = self._unbalanced(moved)
            if float(np.linalg.norm(force)) < size:
                return moved, force
        return None


def _bed(board: Board, mesh: TetMesh, surface: SurfaceQuadrature, tolerance_mm: float, stiffness: float) -> _Bed:
    points = surface.positions(mesh.nodes)
    heights = (points - board.point_mm) @ board.normal
    facing = (surface.normals @ board.normal < _FACING) & board.carries(points)
    near = np.abs(heights) <= (np.inf if board.conforming else tolerance_mm)
    return _Bed(board.name, board.normal, np.flatnonzero(facing & near), stiffness, board.conforming)
