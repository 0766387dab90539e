"""One Newton step of the organ in which contact with moving tools is not linearised."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.body import Balance, Body, ToolState
from glisson.mechanics.contact import Touch
from glisson.mechanics.linear_solvers import Condensation, make_condensation
from glisson.mechanics.local_contact import LocalContact
from glisson.mechanics.patch import Patch, find_patch
from glisson.mechanics.spring import Spring

_NEAR = 0.1  # residual below which even the spring of an organ that would buckle without its tools is trusted


@dataclass(frozen=True, eq=False)
class CondensedStep:
    """A step (n, 3) in mm, and by how much (µJ) it lowers the linearised organ's energy."""

    step: FloatArray
    gain: float


class Condenser:
    """Condenses the organ onto the patch near moving tools; keeps the analysis as long as the patch serves."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._patch: Patch | None = None
        self._condensation: Condensation | None = None
        self._spring: Spring | None = None
        self._system = body.system

    def patch(self, positions: FloatArray, goal: tuple[float, ...]) -> Patch | None:
        """The surface that tools may touch on their way to the angles `goal`; None where there is none."""
        if not self._body.moving:
            return None
        known = self._patch if self._body.system is self._system else None
        patch = find_patch(self._body, positions, goal, known)
        if patch is not None and patch is not known:
            self.close()
            self._condensation = make_condensation(len(self._body.system.free), patch.kept)
            self._patch, self._system = patch, self._body.system
        return patch

    def step(
        self,
        patch: Patch,
        positions: FloatArray,
        touches: Sequence[Touch],
        balance: Balance,
        change: FloatArray,
        carried: FloatArray,
        goal: ToolState,
        tolerance: float,
        exact: bool,
    ) -> CondensedStep | None:
        """The step under what is unbalanced and a `change` (n, 3) of loads, the tools going to their goal.

        What is carried goes by `carried` (n, 3), which is not in the step; its pull is part of the change.

        Friction's memory in the body becomes that at the goal. None where contact can't be settled. Unless
        `exact`, the organ's stiffness may be that of an earlier call, which spares a factorisation.
        """
        body, condensation = self._body, self._condensation
        assert condensation is not None  # it comes with the patch
        free = body.system.free
        others = balance.unbalanced - np.where(body.fixed, 0.0, body.contact_forces(positions, touches, body.moving))
        points = body.surface.positions(positions)[patch.points]
        drift = body.surface.positions(carried)[patch.points]
        if exact or self._spring is None:
            self._spring = self._condensed(condensation, positions, touches)
        spring = self._spring
        if spring is None:
            return None
        new = condensation.reduce(change.ravel()[free]) if change.any() else np.zeros(len(patch.kept))
        load = condensation.reduce((others + change).ravel()[free])
        start, goal = body.loading.tools.of(body.moving), goal.of(body.moving)
        near = balance.residual <= _NEAR and start == goal and not new.any()
        for candidate in spring.candidates(near):
            parts = [body.contacts[number].part(patch.points) for number in body.moving]
            contact = LocalContact(parts, patch, points, drift, candidate, load, new, balance.scale)
            settled = contact.settle(start, goal, tolerance)
            if settled is None:
                continue
            for number, part in zip(body.moving, parts, strict=True):
                body.contacts[number].states.put(patch.points, part.states)
            step = np.zeros(positions.size)
            step[free] = condensation.expand(settled.displacement)
            return CondensedStep(step.reshape(positions.shape), settled.gain)
        return None

    def _condensed(self, condensation: Condensation, positions: FloatArray, touches: Sequence[Touch]) -> Spring | None:
        """The spring of the organ as it is, made definite only when Cholesky refuses its exact stiffness."""
        body = self._body
        for project in (False, True):
            blocks = body.stiffness(positions, touches, project, tools=body.standing)
            spring = condensation.factor(body.tangent(positions, blocks).upper)
            if spring is not None:
                return Spring(spring)
        return None

    def close(self) -> None:
        """Give the factor's memory back."""
        self._spring = None
        if self._condensation is not None:
            self._condensation.close()
            self._condensation = None
