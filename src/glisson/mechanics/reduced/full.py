"""The full model: every node an unknown. It makes what a reduced model learns from, and is what it falls back to."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.model import Model
from glisson.core.status import Status
from glisson.mechanics.body import scatter_blocks
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import surface_quadrature
from glisson.mechanics.linear_solvers import make_direct_solver
from glisson.mechanics.loads import fixed_unknowns, gravity_forces
from glisson.mechanics.pattern import FreeSystem, Stiffness, block_pattern, pair_slots
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.minimise import Minimum, minimise, rounding_uj
from glisson.mechanics.reduced.pressing import Pressing

TOLERANCE = 1e-6
_LIMIT = 40
_STEPS = 2  # in which a load comes on
_SHORTEST = 1.0 / 64.0
_FAST = 0.3  # share of a residual that a step may leave, without a new stiffness being factored
_SURFACE_PARTS = 2  # of every side of a face, for contact
_CUSHION = Cushion(range_mm=1.0, stiffness_kpa_mm=36.0, hardening=0.0)


class FullModel:
    """Equilibria of a model that is free of stress as scanned.

    Args:
        model: mesh and materials.
        held: the node sets that are held fast.
    """

    def __init__(self, model: Model, held: tuple[str, ...]) -> None:
        mesh = model.mesh
        self.model, self.rest = model, mesh.nodes
        self.elasticity = Elasticity(mesh, model.materials, mesh.nodes)
        self.surface = surface_quadrature(mesh.nodes, mesh, _SURFACE_PARTS)
        self.weights = np.stack([gravity_forces(model, axis) for axis in np.eye(3)])
        self.fixed = fixed_unknowns(model, held)
        self.cushion = _CUSHION
        self.pattern = block_pattern(mesh.tetrahedra, len(mesh.nodes))
        self.system = FreeSystem(self.pattern, self.fixed)
        self.pairs = pair_slots(self.pattern, self.surface.nodes)
        self.solver = make_direct_solver()
        self.volume_mm3 = mesh.volume_mm3

    def dead_forces(self, load: Load) -> FloatArray:
        """Nodal forces (n, 3) in mN of a load without its tool."""
        forces: FloatArray = np.tensordot(load.weight, self.weights, 1)
        np.add.at(forces, load.nodes, load.forces)
        return forces

    def solve(self, load: Load, start: FloatArray | None = None) -> FloatArray:
        """Positions (n, 3) in equilibrium, found from a `start` (n, 3) or, where that fails, from rest.

        Raises:
            StageFailed: no equilibrium was found.
        """
        if start is not None:
            found = self._minimum(load, start)
            if found.converged:
                return found.unknowns
        return self.path(load)[-1]

    def path(self, load: Load) -> list[FloatArray]:
        """Positions (n, 3) in equilibrium on the way from rest, as the load comes on in steps; the last is its end.

        Raises:
            StageFailed: no equilibrium was found.
        """
        found, share, step = [self.rest], 0.0, 1.0 / _STEPS
        while share < 1.0:
            ahead = min(share + step, 1.0)
            answer = self._minimum(load.part(ahead), found[-1])
            if answer.converged:
                found.append(answer.unknowns)
                share = ahead
                continue
            step *= 0.5
            if step < _SHORTEST:
                raise StageFailed("The full model found no equilibrium under a load.", Status.STAGNATED)
        return found[1:]

    def _minimum(self, load: Load, start: FloatArray) -> Minimum:
        return minimise(FullPotential(self, load), start, TOLERANCE, _LIMIT)


class FullPotential:
    """The potential of a load over node positions (n, 3) in mm."""

    def __init__(self, full: FullModel, load: Load) -> None:
        self._full = full
        self._forces = full.dead_forces(load)
        self._pressing = Pressing.of(load, full.cushion)
        self.rounding = rounding_uj(full.elasticity.softest_kpa, full.volume_mm3)
        self._before: float | None = None
        self._last: tuple[FloatArray, FloatArray] | None = None

    def energy(self, positions: FloatArray) -> float:
        """In µJ."""
        full = self._full
        energy = full.elasticity.energy(positions)
        if not np.isfinite(energy):
            return float("inf")
        energy -= float(np.vdot(self._forces, positions - full.rest))
        if self._pressing is not None:
            points = full.surface.positions(positions)
            energy += self._pressing.energy(self._pressing.gaps(points), full.surface.areas)
        return energy

    def gradient(self, positions: FloatArray) -> FloatArray:
        """What is unbalanced (n, 3), zero where held."""
        full = self._full
        gradient = self._elastic(positions) - self._forces - self.pushes(positions)
        gradient[full.fixed] = 0.0
        return gradient

    def pushes(self, positions: FloatArray) -> FloatArray:
        """The tool's forces on the nodes (n, 3)."""
        full = self._full
        if self._pressing is None:
            return np.zeros_like(positions)
        points = full.surface.positions(positions)
        gaps = self._pressing.gaps(points)
        near = self._pressing.near(gaps)
        pushes = np.zeros_like(points)
        normals, _ = self._pressing.derivatives(points[near])
        pushes[near] = (full.surface.areas[near] * full.cushion.pressure(gaps[near]))[:, None] * normals
        return full.surface.scatter(pushes)

    def step(self, positions: FloatArray, gradient: FloatArray) -> FloatArray:
        """Newton's step (n, 3); with the last factor, a tenth of the work, as long as the residual falls fast."""
        full = self._full
        residual = self.residual(positions, gradient)
        slow, self._before = self._before is None or residual > _FAST * self._before, residual
        for project in (False, True) if slow else ():
            if full.solver.factor(Stiffness(full.pattern, full.system, self.blocks(positions, project), positions)):
                break
        step = full.solver.solve(-gradient, 0.0)
        assert step is not None  # direct solvers tell of an indefinite matrix when they factor it
        return step

    def blocks(self, positions: FloatArray, project: bool) -> FloatArray:
        """Stiffness blocks (b, 3, 3)."""
        full = self._full
        blocks = np.zeros((full.pattern.block_count, 3, 3))
        full.elasticity.add_stiffness(positions, full.pattern, blocks, project)
        if self._pressing is not None:
            points = full.surface.positions(positions)
            gaps = self._pressing.gaps(points)
            near = self._pressing.near(gaps)
            normals, curvatures = self._pressing.derivatives(points[near])
            areas = full.surface.areas[near]
            local = self._pressing.stiffness(gaps[near], areas, normals, None if project else curvatures)
            scatter_blocks(near, local, full.surface.shapes, full.pairs, blocks)
        return blocks

    def residual(self, positions: FloatArray, gradient: FloatArray) -> float:
        """Unbalanced force over the largest of the dead and the internal ones."""
        scale = max(float(np.linalg.norm(self._forces)), float(np.linalg.norm(self._elastic(positions))))
        return float(np.linalg.norm(gradient)) / scale if scale > 0.0 else 0.0

    def _elastic(self, positions: FloatArray) -> FloatArray:
        """Internal forces (n, 3); those of the last positions are kept."""
        if self._last is None or self._last[0] is not positions:
            self._last = (positions, self._full.elasticity.forces(positions))
        return self._last[1]
