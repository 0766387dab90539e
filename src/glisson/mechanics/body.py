"""The whole mechanical system at one instant: elastic body, tools, dead loads, held unknowns."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import bsr_matrix

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.scenario import ContactLaw
from glisson.mechanics.contact import ToolContact, Touch
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import SurfaceQuadrature, lumped_volumes
from glisson.mechanics.gas_pressure import GasPressure
from glisson.mechanics.parts import Part
from glisson.mechanics.pattern import FreeSystem, Index, Stiffness, block_pattern, pair_slots

_NO_SHIFT_MM = 1e-4  # shifts of nodes against each other that count as none; far above rounding


@dataclass(frozen=True, eq=False)
class Balance:
    """Forces on the nodes (n, 3) in mN; in equilibrium their sum vanishes on the free unknowns.

    `parts` is what acts beside elements, tools and dead loads. `scale` in mN is the largest of the four norms,
    `residual` the norm of the sum divided by it. A body without stress has the scale of a shift of its nodes by
    0.1 µm against each other.
    """

    internal: FloatArray
    contact: FloatArray
    external: FloatArray
    parts: FloatArray
    scale: float
    residual: float
    unbalanced: FloatArray


@dataclass(frozen=True)
class ToolState:
    """Angles of tools in rad, and the contact law."""

    angles: tuple[float, ...]
    law: ContactLaw

    def of(self, tools: Iterable[int]) -> "ToolState":
        """The state of some of the tools."""
        return ToolState(tuple(self.angles[number] for number in tools), self.law)

    def towards(self, goal: "ToolState", share: float) -> "ToolState":
        """A state on the straight way to another one."""
        angles = tuple(a + share * (b - a) for a, b in zip(self.angles, goal.angles, strict=True))
        friction = self.law.friction + share * (goal.law.friction - self.law.friction)
        cohesion = self.law.cohesion_kpa + share * (goal.law.cohesion_kpa - self.law.cohesion_kpa)
        return ToolState(angles, ContactLaw(friction, cohesion))


@dataclass(frozen=True, eq=False)
class LoadState:
    """What is done to the organ: tools, dead loads (n, 3) in mN, how far held unknowns were carried, gas pressure.

    `carried` (n, 3) in mm counts from the stage's start and is zero on free unknowns.
    """

    tools: ToolState
    external: FloatArray
    carried: FloatArray
    gas_pressure_kpa: float = 0.0

    def towards(self, goal: "LoadState", share: float) -> "LoadState":
        """A state on the straight way to another one."""
        external = self.external + share * (goal.external - self.external)
        carried = self.carried + share * (goal.carried - self.carried)
        pressure = self.gas_pressure_kpa + share * (goal.gas_pressure_kpa - self.gas_pressure_kpa)
        return LoadState(self.tools.towards(goal.tools, share), external, carried, pressure)


@dataclass(frozen=True, eq=False)
class Drag:
    """What a thick fluid does in a unit of time: a force of `rates` (n,) in mN/mm towards where nodes (n, 3) were."""

    rates: FloatArray
    start: FloatArray

    def energy(self, positions: FloatArray) -> float:
        """Half the work in µJ."""
        return 0.5 * float(self.rates @ np.sum((positions - self.start) ** 2, axis=1))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (n, 3) in mN."""
        forces: FloatArray = self.rates[:, None] * (self.start - positions)
        return forces


class Body:
    """Energy, forces and stiffness of everything, as functions of the node positions (n, 3) in mm.

    Args:
        elasticity: the elastic body.
        surface: quadrature points of its boundary.
        contacts: one for each tool.
        fixed: (n, 3) which unknowns are held.
        parts: what else acts on the nodes.
        gas: the gas around it, if there is some.
    """

    def __init__(
        self,
        elasticity: Elasticity,
        surface: SurfaceQuadrature,
        contacts: Sequence[ToolContact],
        fixed: NDArray[np.bool_],
        parts: Sequence[Part] = (),
        gas: GasPressure | None = None,
    ) -> None:
        self.elasticity = elasticity
        self.surface = surface
        self.contacts = tuple(contacts)
        self.gas = gas
        self.parts: tuple[Part, ...] = (*parts, *(() if gas is None else (gas,)))
        self.moving = tuple(n for n, contact in enumerate(self.contacts) if contact.tool.moves)
        self.standing = tuple(n for n in range(len(self.contacts)) if n not in self.moving)
        self.external = np.zeros_like(elasticity.rest)
        self.law = ContactLaw()
        self.drag: Drag | None = None
        lengths = lumped_volumes(elasticity.rest, elasticity.mesh) ** (1.0 / 3.0)
        self._least_scale = _NO_SHIFT_MM * elasticity.softest_kpa * float(np.linalg.norm(lengths))
        self._pattern = block_pattern(elasticity.mesh.tetrahedra, len(elasticity.rest))
        self._pairs = pair_slots(self._pattern, surface.nodes)
        self.hold(fixed)

    def _cover(self, groups: Sequence[IntArray]) -> None:
        """Let the pattern have a block for every pair of nodes of the groups (k, a)."""
        missing = [nodes for nodes in groups if not self._pattern.covers(nodes)]
        if missing:
            self._pattern = self._pattern.with_groups(missing)
            self._pairs = pair_slots(self._pattern, self.surface.nodes)
            self.system = FreeSystem(self._pattern, self.fixed)

    def hold(self, fixed: NDArray[np.bool_]) -> None:
        """Change which unknowns (n, 3) are held, where they are now."""
        self.fixed = fixed
        self.carried = np.zeros_like(self.elasticity.rest)
        self.system = FreeSystem(self._pattern, fixed)

    def contact_number(self, tool: str) -> int:
        """The number of the contact with a tool of that name."""
        return next(n for n, contact in enumerate(self.contacts) if contact.tool.name == tool)

    @property
    def loading(self) -> LoadState:
        """The present tools and loads."""
        angles = tuple(contact.angle for contact in self.contacts)
        pressure = 0.0 if self.gas is None else self.gas.pressure_kpa
        return LoadState(ToolState(angles, self.law), self.external, self.carried, pressure)

    @loading.setter
    def loading(self, state: LoadState) -> None:
        for contact, angle in zip(self.contacts, state.tools.angles, strict=True):
            contact.angle = angle
        self.law, self.external, self.carried = state.tools.law, state.external, state.carried
        if self.gas is not None:
            self.gas.pressure_kpa = state.gas_pressure_kpa

    def load_change(self, positions: FloatArray, goal: LoadState) -> FloatArray:
        """By how much (n, 3) in mN loads of the goal differ from the present ones; tools and what is carried apart."""
        change: FloatArray = goal.external - self.external
        if self.gas is not None:
            change = change + self.gas.forces_at(positions, goal.gas_pressure_kpa - self.gas.pressure_kpa)
        return change

    def touches(self, positions: FloatArray, update_friction: bool = True) -> tuple[Touch, ...]:
        """Where each tool touches; friction limits follow the present pressure unless told not to."""
        points = self.surface.positions(positions)
        touches = tuple(contact.touch(points) for contact in self.contacts)
        if update_friction:
            for contact, touch in zip(self.contacts, touches, strict=True):
                contact.update_friction(touch, self.law)
            for part in self.parts:
                part.renew(positions)
        return touches

    def renew_cohesion(self, positions: FloatArray) -> int:
        """Let cohesion act where tools press now; how many surface points lost it thereby."""
        touches = self.touches(positions, update_friction=False)
        return sum(c.renew_cohesion(touch) for c, touch in zip(self.contacts, touches, strict=True))

    def add_cohesion(self, touches: Sequence[Touch]) -> None:
        """Let surface points that newly touch cohere at once."""
        for contact, touch in zip(self.contacts, touches, strict=True):
            contact.add_cohesion(touch)

    def energy(self, positions: FloatArray) -> float:
        """Potential in µJ with friction limits as last updated; infinite where an element is inverted."""
        elastic = self.elasticity.energy(positions)
        if not np.isfinite(elastic):
            return float("inf")
        touching = 0.0
        if self.contacts:
            points = self.surface.positions(positions)
            touching = sum(contact.energy(points) for contact in self.contacts)
        dragging = 0.0 if self.drag is None else self.drag.energy(positions)
        acting = sum(part.energy(positions) for part in self.parts)
        return elastic + touching + dragging + acting - float(np.vdot(self.external, positions - self.elasticity.rest))

    def is_possible(self, positions: FloatArray) -> bool:
        """Whether no element is inverted, and no part forbids it (a surface that cuts itself)."""
        energies = (self.elasticity.energy(positions), *(part.energy(positions) for part in self.parts))
        return bool(np.isfinite(energies).all())

    def balance(self, positions: FloatArray, touches: Sequence[Touch]) -> Balance:
        """All nodal forces and what is left of them on the free unknowns."""
        internal = -self.elasticity.forces(positions)
        contact_forces = self.contact_forces(positions, touches, range(len(self.contacts)))
        parts = sum((part.forces(positions) for part in self.parts), np.zeros_like(positions))
        unbalanced = internal + contact_forces + self.external + parts
        if self.drag is not None:
            unbalanced += self.drag.forces(positions)
        unbalanced[self.fixed] = 0.0
        largest = max(float(np.linalg.norm(part)) for part in (internal, contact_forces, self.external, parts))
        scale = max(largest, self._least_scale)
        residual = float(np.linalg.norm(unbalanced)) / scale
        return Balance(internal, contact_forces, self.external, parts, scale, residual, unbalanced)

    def contact_forces(self, positions: FloatArray, touches: Sequence[Touch], tools: Iterable[int]) -> FloatArray:
        """Nodal forces (n, 3) in mN of the tools of the given numbers."""
        if not touches:
            return np.zeros_like(positions)
        points = self.surface.positions(positions)
        pushes = np.zeros_like(points)
        for number in tools:
            pushes += self.contacts[number].forces(touches[number], points)
        return self.surface.scatter(pushes)

    def stiffness(
        self, positions: FloatArray, touches: Sequence[Touch], project: bool, tools: Iterable[int] | None = None
    ) -> FloatArray:
        """Blocks (b, 3, 3) of ∂²Π/∂x², with all tools or those of the given numbers.

        `project` makes them positive semi-definite.
        """
        coupled = [part.stiffness(positions, project) for part in self.parts]
        self._cover([groups for groups, _ in coupled])
        blocks = np.zeros((self._pattern.block_count, 3, 3))
        for groups, local in coupled:
            self._pattern.add_groups(groups, local, blocks)
        self.elasticity.add_stiffness(positions, self._pattern, blocks, project)
        if self.drag is not None:
            self._pattern.add_diagonal(self.drag.rates, blocks)
        points = self.surface.positions(positions)
        for number in range(len(self.contacts)) if tools is None else tools:
            used, local = self.contacts[number].stiffness(touches[number], points, project)
            scatter_blocks(used, local, self.surface.shapes, self._pairs, blocks)
        return blocks

    def add_friction_by_pressure(self, positions: FloatArray, touches: Sequence[Touch], blocks: FloatArray) -> None:
        """Make the stiffness the exact derivative of the forces, friction limits following the pressure."""
        points = self.surface.positions(positions)
        for contact, touch in zip(self.contacts, touches, strict=True):
            used, local = contact.friction_by_pressure(touch, points, self.law)
            scatter_blocks(used, local, self.surface.shapes, self._pairs, blocks)

    def add_bonds(self, positions: FloatArray, blocks: FloatArray) -> None:
        """Glue what nearly touches to its tool, for the first guess of a body that nothing holds yet."""
        points = self.surface.positions(positions)
        for contact in self.contacts:
            used, local = contact.bond(points)
            scatter_blocks(used, local, self.surface.shapes, self._pairs, blocks)

    def add_shift(self, share: float, blocks: FloatArray) -> None:
        """Add a share of the mean diagonal to the diagonal."""
        mean = float(self._pattern.diagonal(blocks).mean())
        self._pattern.add_diagonal(np.full(len(self.fixed), share * mean), blocks)

    def accept(self, positions: FloatArray) -> None:
        """Let friction's memory follow a converged load step."""
        points = self.surface.positions(positions)
        for contact in self.contacts:
            contact.drag_anchors(points)
        for part in self.parts:
            part.accept(positions)

    def memory(self) -> tuple[Any, ...]:
        """What tools and parts remember, and a rejected step must put back."""
        return tuple(contact.memory() for contact in self.contacts), tuple(part.memory() for part in self.parts)

    def recall(self, memory: tuple[Any, ...]) -> None:
        """Put back what `memory` returned."""
        of_contacts, of_parts = memory
        for contact, kept in zip(self.contacts, of_contacts, strict=True):
            contact.recall(kept)
        for part, kept in zip(self.parts, of_parts, strict=True):
            part.recall(kept)

    def tangent(self, positions: FloatArray, blocks: FloatArray) -> Stiffness:
        """The matrix of stiffness blocks found at the positions, for solvers."""
        return Stiffness(self._pattern, self.system, blocks, positions)

    def matrix(self, blocks: FloatArray) -> bsr_matrix:
        """The stiffness over all unknowns, for products with nodal fields."""
        return self._pattern.matrix(blocks)


@njit(cache=True)
def scatter_blocks(used: IntArray, local: FloatArray, shapes: FloatArray, pairs: Index, blocks: FloatArray) -> None:
    """Add N_a N_b times the 3 × 3 matrices `local` (k, 3, 3) of the surface points `used` (k,) to the blocks."""
    size = shapes.shape[1]
    for n in range(len(used)):
        p = used[n]
        for a in range(size):
            for b in range(size):
                weight = shapes[p, a] * shapes[p, b]
                slot = pairs[p, a, b]
                for i in range(3):
                    for j in range(3):
                        blocks[slot, i, j] += weight * local[n, i, j]
