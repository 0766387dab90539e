"""A held body under forces on a patch of its surface, in few modes: equilibria, and how they follow the forces."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.mechanics.reduced.minimise import minimise
from glisson.mechanics.reduced.points import ElasticPoints
from glisson.mechanics.reduced.potential import ReducedPotential

_TOLERANCE = 1e-5
_LIMIT = 40


@dataclass(frozen=True, eq=False)
class Pulled:
    """An equilibrium: amounts (b, 3) of the forces, modal displacements (r,), stiffness (r, r) there or nearby."""

    amounts: FloatArray
    modal: FloatArray
    stiffness: FloatArray


@dataclass(frozen=True, eq=False)
class PulledBody:
    """x = X + Φ q, in equilibrium with the forces S a.

    Args:
        rest: X (n, 3) in mm.
        basis: Φ (n, 3, r), zero where held.
        points: where elastic energy is taken.
        patch: (k,) nodes that forces act on.
        shares: S (k, b) in mN, of each amount along any axis.
    """

    rest: FloatArray
    basis: FloatArray
    points: ElasticPoints
    patch: IntArray
    shares: FloatArray

    @property
    def count(self) -> int:
        """The number 3 b of amounts."""
        return 3 * int(self.shares.shape[1])

    @cached_property
    def at_rest(self) -> Pulled:
        """Without forces."""
        return self.state(np.zeros((self.shares.shape[1], 3)), np.zeros(self.basis.shape[2]))

    @cached_property
    def _pulls(self) -> FloatArray:
        """Forces (r, 3 b) of unit amounts on the modes."""
        pulls = np.einsum("kb,kir->rbi", self.shares, self.basis[self.patch])
        return np.ascontiguousarray(pulls.reshape(len(pulls), -1))

    @cached_property
    def _fields(self) -> FloatArray:
        # Single precision is read twice as fast.
        return np.ascontiguousarray(self.basis.reshape(self.rest.size, -1), dtype=np.float32)

    def forces(self, state: Pulled) -> FloatArray:
        """Forces (n, 3) in mN on all nodes."""
        forces = np.zeros_like(self.rest)
        forces[self.patch] = self.shares @ state.amounts
        return forces

    def positions(self, state: Pulled) -> FloatArray:
        """Node positions (n, 3) in mm."""
        return self.rest + self.fields(state.modal)

    def fields(self, modal: FloatArray) -> FloatArray:
        """Displacements (n, 3) or (n, 3, c) in mm of modal ones (r,) or (r, c), good to a micrometre."""
        result: FloatArray = (self._fields @ modal.astype(np.float32)).astype(np.float64)
        return result.reshape(*self.rest.shape, *modal.shape[1:])

    def follows(self, state: Pulled) -> FloatArray:
        """Derivative (r, 3 b) of the modal displacements by the amounts: the compliance."""
        result: FloatArray = cho_solve(cho_factor(state.stiffness), self._pulls)
        return result

    def moved(self, state: Pulled, step: FloatArray) -> Pulled:
        """The equilibrium after a step (3 b,) of the amounts.

        Raises:
            StageFailed: there is none near.
        """
        amounts = state.amounts + step.reshape(-1, 3)
        potential = ReducedPotential(self.points, self._pulls @ amounts.ravel(), None, state.stiffness)
        begun = state.modal + self.follows(state) @ step
        if not np.isfinite(potential.energy(begun)):
            begun = state.modal
        found = minimise(potential, begun, _TOLERANCE, _LIMIT)
        if not found.converged:
            raise StageFailed("The organ finds no equilibrium under the forces.", Status.STAGNATED)
        return Pulled(amounts, found.unknowns, potential.tangent(found.unknowns))

    def state(self, amounts: FloatArray, modal: FloatArray) -> Pulled:
        """A state by its amounts (b, 3) and modal displacements (r,), which may be a little out of equilibrium."""
        gradients = self.points.gradients(modal)
        stiffness = self.points.stiffness(gradients)
        try:
            np.linalg.cholesky(stiffness)
        except np.linalg.LinAlgError:  # it is about to buckle
            stiffness = self.points.stiffness(gradients, project=True)
        return Pulled(amounts, modal, stiffness)

    def nearest(self, positions: FloatArray, forces: FloatArray) -> Pulled:
        """The state next to node positions (n, 3) in mm and forces (n, 3) in mN."""
        modal = np.tensordot(positions - self.rest, self.basis, 2)
        amounts = np.linalg.lstsq(self.shares, forces[self.patch], rcond=None)[0].astype(np.float64)
        return self.state(amounts, modal)
