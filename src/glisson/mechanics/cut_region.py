"""A part of the organ that is solved for itself: the elements that move, held where they are cut from the others."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.mechanics.body import Body, LoadState
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import SurfaceQuadrature
from glisson.mechanics.gas_pressure import GasPressure
from glisson.mechanics.parts import Part


@dataclass(frozen=True, eq=False)
class CutRegion:
    """A body of some of the elements of another one.

    `nodes` (k,) are its nodes' numbers in the whole body, `points` (p,) those of its surface points, and `cut` (k,)
    says which of its nodes lie on the cut; these are held.
    """

    body: Body
    nodes: IntArray
    points: IntArray
    cut: NDArray[np.bool_]

    def goal(self, of_whole: LoadState, motion: FloatArray) -> LoadState:
        """The part of a goal of the whole body, the cut going along with a motion (n, 3) in mm of its nodes."""
        carried = np.where(self.cut[:, None], motion[self.nodes], of_whole.carried[self.nodes])
        return replace(of_whole, external=of_whole.external[self.nodes], carried=carried)

    def follow(self, whole: Body, positions: FloatArray) -> None:
        """Take over friction's memory from the whole body at node positions (n, 3), and where the others' nodes are."""
        for part, contact in zip(self.body.contacts, whole.contacts, strict=True):
            part.states = contact.states.take(self.points)
        for within in self.body.parts:
            if isinstance(within, _PartWithin):
                within.positions = positions

    def lead(self, whole: Body) -> None:
        """Let tools and friction of the whole body be as they are here."""
        for part, contact in zip(self.body.contacts, whole.contacts, strict=True):
            contact.states.put(self.points, part.states)
            contact.cushion = part.cushion


def cut_out(whole: Body, elements: NDArray[np.bool_], positions: FloatArray) -> CutRegion:
    """The body of some elements (m,) of a whole one at node positions (n, 3), as loaded as that is."""
    elements = _closed(whole, elements, positions)
    mesh = whole.elasticity.mesh
    inside, outside = np.zeros(len(positions), dtype=bool), np.zeros(len(positions), dtype=bool)
    inside[mesh.tetrahedra[elements]] = True
    outside[mesh.tetrahedra[~elements]] = True
    nodes = np.flatnonzero(inside)
    numbers = np.full(len(positions), -1)
    numbers[nodes] = np.arange(len(nodes))
    part = TetMesh(mesh.nodes[nodes], numbers[mesh.tetrahedra[elements]], mesh.region_numbers[elements])
    cut = outside[nodes]
    points = np.flatnonzero(inside[whole.surface.nodes].all(axis=1))
    rows = whole.surface.part(points)
    surface = SurfaceQuadrature(numbers[rows.nodes], rows.shapes, rows.areas, rows.normals, len(nodes))
    body = Body(
        Elasticity(part, whole.elasticity.materials, whole.elasticity.rest[nodes]),
        surface,
        [contact.part(points) for contact in whole.contacts],
        whole.fixed[nodes] | cut[:, None],
        [_PartWithin(one, nodes, positions) for one in whole.parts if one is not whole.gas],
        None if whole.gas is None else GasPressure(part),
    )
    region = CutRegion(body, nodes, points, cut)
    body.loading = region.goal(replace(whole.loading, carried=np.zeros_like(positions)), np.zeros_like(positions))
    for contact, original in zip(body.contacts, whole.contacts, strict=True):
        contact.cushion = original.cushion
    return region


def _closed(whole: Body, elements: NDArray[np.bool_], positions: FloatArray) -> NDArray[np.bool_]:
    """The elements, and those others with which they are coupled by what acts beside elements (a rod, ties)."""
    tetrahedra = whole.elasticity.mesh.tetrahedra
    groups = [part.stiffness(positions, project=False)[0] for part in whole.parts]
    while True:
        inside, outside = np.zeros(len(positions), dtype=bool), np.zeros(len(positions), dtype=bool)
        inside[tetrahedra[elements]] = True
        outside[tetrahedra[~elements]] = True
        missing = np.zeros(len(positions), dtype=bool)
        for group in groups:
            torn = (inside & ~outside)[group].any(axis=1) & ~inside[group].all(axis=1)
            missing[group[torn]] = True
        found = elements | missing[tetrahedra].any(axis=1)
        if not missing.any() or (found == elements).all():
            return elements
        elements = found


@dataclass(eq=False)
class _PartWithin:
    """A `Part` of the whole body as a region feels it, the others' nodes being where they are."""

    part: Part
    nodes: IntArray
    positions: FloatArray

    def energy(self, positions: FloatArray) -> float:
        """Potential in µJ."""
        return self.part.energy(self._whole(positions))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (k, 3) in mN."""
        return self.part.forces(self._whole(positions))[self.nodes]

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """Groups that lie within the region; the nodes of others are held."""
        groups, local = self.part.stiffness(self._whole(positions), project)
        numbers = self._numbers[groups]
        within = (numbers >= 0).all(axis=1)
        return numbers[within], local[within]

    def renew(self, positions: FloatArray) -> None:
        """Friction's limits."""
        self.part.renew(self._whole(positions))

    def accept(self, positions: FloatArray) -> None:
        """What a load step leaves behind."""
        self.part.accept(self._whole(positions))

    def memory(self) -> Any:
        """What a rejected step must put back."""
        return self.part.memory()

    def recall(self, memory: Any) -> None:
        """Put it back."""
        self.part.recall(memory)

    @cached_property
    def _numbers(self) -> IntArray:
        numbers = np.full(len(self.positions), -1)
        numbers[self.nodes] = np.arange(len(self.nodes))
        return numbers

    def _whole(self, positions: FloatArray) -> FloatArray:
        whole = self.positions.copy()
        whole[self.nodes] = positions
        return whole
