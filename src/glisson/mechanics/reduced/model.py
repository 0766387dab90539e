"""The reduced model: modes, the elements that count, the surface in the modes, and its error estimate."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.reduced.contact import ReducedContact, ReducedSurface
from glisson.mechanics.reduced.estimate import ErrorEstimate
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.local import LocalCompliance, turn_of
from glisson.mechanics.reduced.minimise import minimise
from glisson.mechanics.reduced.points import ElasticPoints
from glisson.mechanics.reduced.potential import ReducedPotential

_TOLERANCE = 1e-5
_LIMIT = 40
_LINEAR_SHARE = 0.2  # of what gives way beyond the modes, which is taken as linear


@dataclass(frozen=True, eq=False)
class State:
    """Modal displacements (r,), and the tool's forces (k, 3) in mN on nodes it reaches, which have turned by `turn`.

    `tangent` (r, r) is the elastic stiffness nearby.
    """

    modal: FloatArray
    forces: FloatArray
    turn: FloatArray
    tangent: FloatArray

    def beyond(self, before: "State") -> "State":
        """Where the organ would be next if it went on as it came from the state before."""
        return State(2.0 * self.modal - before.modal, 2.0 * self.forces - before.forces, self.turn, self.tangent)


@dataclass(frozen=True, eq=False)
class Answer:
    """The state in equilibrium, if it has `converged`.

    `shift` (n, 3) in mm is how nodes give way beyond the modes, `unknowns` (r + c,) are what was solved for with the
    `contact`.
    """

    state: State
    shift: FloatArray
    unknowns: FloatArray
    contact: ReducedContact | None
    iterations: int
    converged: bool


@dataclass(frozen=True, eq=False)
class ReducedModel:
    """An organ of r unknowns, and of some more next to a tool.

    Args:
        rest: (n, 3) node positions in mm without stress.
        basis: (n, 3, R) modes; the first r are the unknowns, the others only estimate the error.
        points: where the elastic energy is taken, strained by the r modes.
        surface: in the R modes.
        local: how the surface gives way beyond the r modes.
        weights: (3, R) the organ's weight along each axis, on the modes, in mN.
        cushion: between organ and tools.
        estimate: of the error.
    """

    rest: FloatArray
    basis: FloatArray
    points: ElasticPoints
    surface: ReducedSurface
    local: LocalCompliance
    weights: FloatArray
    cushion: Cushion
    estimate: ErrorEstimate

    @cached_property
    def _few(self) -> ReducedSurface:
        return self.surface.in_modes(self.size)

    @cached_property
    def _fields(self) -> FloatArray:
        # Single precision is read twice as fast, and good to a micrometre.
        return np.ascontiguousarray(self.basis[:, :, : self.size], dtype=np.float32)

    @property
    def size(self) -> int:
        """The number of modal unknowns r."""
        return int(self.points.strains.shape[2])

    @property
    def at_rest(self) -> State:
        """The state without a load."""
        tangent = self.estimate.stiffness[: self.size, : self.size]
        return State(np.zeros(self.size), np.zeros((len(self.local.nodes), 3)), np.eye(3), tangent)

    def dead_forces(self, load: Load) -> FloatArray:
        """Forces (R,) on all modes of a load without its tool."""
        result: FloatArray = load.weight @ self.weights + self._pull(load)
        return result

    def _pull(self, load: Load) -> FloatArray:
        result: FloatArray = np.tensordot(load.forces, self.basis[load.nodes], 2)
        return result

    def solve(self, load: Load, start: State | None = None) -> Answer:
        """Equilibrium, looked for from a state nearby or from rest."""
        start = start or self.at_rest
        dead = self.dead_forces(load)[: self.size]
        pulls = self.local.on_nodes(load.nodes, load.forces)
        contact, unknowns = None, start.modal
        if load.tool is not None:
            contact = ReducedContact(self._few, self.local, load, self.cushion, start.modal, pulls)
            pushes = np.einsum("ci,ci->c", start.forces[contact.pushed], contact.normals)
            unknowns = np.concatenate([start.modal, pushes])
        potential = ReducedPotential(self.points, dead, contact, start.tangent)
        found = minimise(potential, unknowns, _TOLERANCE, _LIMIT)
        modal, forces = found.unknowns[: self.size], np.zeros_like(start.forces)
        if contact is None:
            loaded = self.rest[load.nodes]
            turn = turn_of(loaded, loaded + self._fields[load.nodes] @ modal)
        else:
            turn = contact.turn
            forces[contact.pushed] = found.unknowns[self.size :, None] * contact.normals
        state = State(modal, forces, turn, potential.tangent(found.unknowns))
        shift = self.local.displacement(forces + pulls, turn)
        return Answer(state, shift, found.unknowns, contact, found.iterations, found.converged)

    def raw_error_mm(self, load: Load, answer: Answer) -> float:
        """The estimate before its factor."""
        pull = self._pull(load)[: self.size]
        weight = load.weight @ self.weights
        modal = self.estimate.modal_mm(
            answer.unknowns, answer.state.tangent, weight, pull, answer.contact, self.surface
        )
        return modal + _LINEAR_SHARE * float(np.sqrt(np.einsum("ni,ni->n", answer.shift, answer.shift).max()))

    def positions(self, answer: Answer) -> FloatArray:
        """Node positions (n, 3) in mm."""
        result: FloatArray = self.rest + self._fields @ answer.state.modal.astype(np.float32) + answer.shift
        return result

    def state(self, positions: FloatArray) -> State:
        """The state without a tool next to node positions (n, 3)."""
        rest = self.at_rest
        return replace(rest, modal=np.tensordot(positions - self.rest, self.basis[:, :, : self.size], 2))
