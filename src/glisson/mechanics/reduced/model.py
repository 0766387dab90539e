"""The reduced model: modes, the elements that count, the surface in the modes, and its error estimate."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.reduced.contact import ReducedContact, ReducedSurface
from glisson.mechanics.reduced.estimate import ErrorEstimate
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.minimise import Minimum, minimise
from glisson.mechanics.reduced.points import ElasticPoints
from glisson.mechanics.reduced.potential import ReducedPotential

_TOLERANCE = 1e-5
_LIMIT = 40


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """An organ of r unknowns.

    Args:
        rest: (n, 3) node positions in mm without stress.
        basis: (n, 3, R) modes; the first r are the unknowns, the others only estimate the error.
        points: where the elastic energy is taken, strained by the r modes.
        surface: in the r modes.
        weights: (3, R) the organ's weight along each axis, on the modes, in mN.
        cushion: between organ and tools.
        estimate: of the error.
    """

    rest: FloatArray
    basis: FloatArray
    points: ElasticPoints
    surface: ReducedSurface
    weights: FloatArray
    cushion: Cushion
    estimate: ErrorEstimate

    @property
    def size(self) -> int:
        """The number of unknowns r."""
        return self.points.strains.shape[2]

    def dead_forces(self, load: Load) -> FloatArray:
        """Forces (R,) on all modes of a load without its tool."""
        of_nodes = np.einsum("ki,kir->r", load.forces, self.basis[load.nodes])
        result: FloatArray = load.weight @ self.weights + of_nodes
        return result

    def solve(self, load: Load, start: FloatArray | None = None) -> Minimum:
        """Modal displacements (r,) in equilibrium, from a state (r,) nearby or from rest."""
        start = np.zeros(self.size) if start is None else start
        contact = None if load.tool is None else ReducedContact(self.surface, load, self.cushion, start)
        potential = ReducedPotential(self.points, self.dead_forces(load)[: self.size], contact)
        return minimise(potential, start, _TOLERANCE, _LIMIT)

    def raw_error_mm(self, load: Load, modal: FloatArray) -> float:
        """The estimate before its factor."""
        return self.estimate.raw_mm(modal, self.dead_forces(load), load, self.cushion)

    def bound_mm(self, load: Load, modal: FloatArray) -> float:
        """What no node is farther from the full model's answer, by all that calibration saw."""
        return self.estimate.bound_mm(self.raw_error_mm(load, modal))

    def positions(self, modal: FloatArray) -> FloatArray:
        """Node positions (n, 3) in mm."""
        result: FloatArray = self.rest + self.basis[:, :, : self.size] @ modal
        return result

    def modal(self, positions: FloatArray) -> FloatArray:
        """The state (r,) next to node positions (n, 3)."""
        result: FloatArray = np.tensordot(positions - self.rest, self.basis[:, :, : self.size], 2)
        return result
