"""The reduced model: modes, the elements that count, the surface in the modes, and its error estimate."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.reduced.contact import ReducedContact, ReducedSurface
from glisson.mechanics.reduced.estimate import ErrorEstimate
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.local import LocalCompliance, Pulled, turn_of
from glisson.mechanics.reduced.minimise import minimise
from glisson.mechanics.reduced.points import ElasticPoints
from glisson.mechanics.reduced.potential import ReducedPotential

_TOLERANCE = 3e-4
_LIMIT = 40
_PULLED, _PUSHED = 0.1, 0.15  # how wrong the local compliance may be, as a share of it


@dataclass(frozen=True, eq=False)
class State:
    """Modal displacements (r,), and the tool's forces (k, 3) in mN on nodes it reaches, which have turned by `turn`.

    `tangent` (r, r) is the elastic stiffness nearby, `pulled` what pulls move beyond the modes.
    """

    modal: FloatArray
    forces: FloatArray
    turn: FloatArray
    tangent: FloatArray
    pulled: Pulled

    def beyond(self, before: "State") -> "State":
        """Where the organ would be next if it went on as it came from the state before."""
        return replace(self, modal=2.0 * self.modal - before.modal, forces=2.0 * self.forces - before.forces)


@dataclass(frozen=True, eq=False)
class Answer:
    """The state in equilibrium, if it has `converged`.

    `pulled` and `pushed` (n, 3) in mm are how nodes give way beyond the modes to pulls and to the tool, `unknowns`
    (r + c,) are what was solved for with the `contact`.
    """

    state: State
    pulled: FloatArray
    pushed: FloatArray
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
        return np.ascontiguousarray(self.basis[:, :, : self.size].reshape(-1, self.size), dtype=np.float32)

    @property
    def size(self) -> int:
        """The number of modal unknowns r."""
        return int(self.points.strains.shape[2])

    @cached_property
    def at_rest(self) -> State:
        """The state without a load."""
        tangent, forces = self.estimate.stiffness[: self.size, : self.size], np.zeros((len(self.local.nodes), 3))
        return State(np.zeros(self.size), forces, np.eye(3), tangent, Pulled.of(self.local, forces))

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
        pulled = start.pulled.by(pulls) or Pulled.of(self.local, pulls)
        contact, unknowns = None, start.modal
        if load.tool is not None:
            contact = ReducedContact(self._few, self.local, load, self.cushion, start.modal, pulled)
            pushes = np.einsum("ci,ci->c", start.forces[contact.pushed], contact.normals)
            unknowns = np.concatenate([start.modal, pushes])
        potential = ReducedPotential(self.points, dead, contact, start.tangent)
        found = minimise(potential, unknowns, _TOLERANCE, _LIMIT)
        modal, forces = found.unknowns[: self.size], np.zeros_like(start.forces)
        if contact is None:
            loaded = self.rest[load.nodes]
            turn = turn_of(loaded, loaded + self.basis[load.nodes, :, : self.size] @ modal)
        else:
            turn = contact.turn
            forces[contact.pushed] = found.unknowns[self.size :, None] * contact.normals
        state = State(modal, forces, turn, potential.tangent(found.unknowns), pulled)
        pushed = self.local.displacement(forces, turn)
        return Answer(
            state, pulled.displacement(turn), pushed, found.unknowns, contact, found.iterations, found.converged
        )

    def raw_error_mm(self, load: Load, answer: Answer) -> float:
        """The estimate before its factor."""
        pull = self._pull(load)[: self.size]
        weight = load.weight @ self.weights
        modal, pushed = self.estimate.modal_mm(
            answer.unknowns, answer.state.tangent, weight, pull, answer.contact, self.surface
        )
        raw = modal + _PULLED * largest(answer.pulled) + _PUSHED * pushed
        if answer.contact is not None:
            raw += self.local.mean_mm_per_mn * answer.contact.unknown_force(answer.unknowns)
        return raw

    def positions(self, answer: Answer) -> FloatArray:
        """Node positions (n, 3) in mm."""
        modal = (self._fields @ answer.state.modal.astype(np.float32)).reshape(self.rest.shape)
        result: FloatArray = self.rest + modal + answer.pulled + answer.pushed
        return result

    def state(self, positions: FloatArray) -> State:
        """The state without a tool next to node positions (n, 3)."""
        rest = self.at_rest
        return replace(rest, modal=np.tensordot(positions - self.rest, self.basis[:, :, : self.size], 2))


def largest(vectors: FloatArray) -> float:
    """The length of the longest of vectors (n, 3)."""
    return float(np.sqrt(np.einsum("ni,ni->n", vectors, vectors).max()))
