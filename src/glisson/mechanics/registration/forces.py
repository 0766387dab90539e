"""Technique "forces": the organ is held, and unknown forces pull at a part of its surface."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from glisson.core.arrays import IntArray
from glisson.core.errors import BadInput
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.core.scenario import Scenario
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.registration.checks import check_last, check_observations
from glisson.mechanics.registration.contradictions import contradiction, misfits
from glisson.mechanics.registration.elastic_parameters import ERROR_HELP, LENGTH_HELP
from glisson.mechanics.registration.force_fit import ForceFit, fit_forces, force_spread
from glisson.mechanics.registration.outcome import outcome
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.pulled_body import Pulled, PulledBody
from glisson.mechanics.registration.pulled_body_building import pulled_body
from glisson.mechanics.registration.seen import ModelError, Seen
from glisson.mechanics.registration.smooth_forces import smooth_forces


@dataclass(frozen=True)
class ForcesParameters:
    """Parameters of the pulled organ."""

    held: str = parameter("back", "node set that is held fast")
    pulled: str = parameter("", "node set that forces may act on; by default all of the surface that is not held")
    reach_mm: float = parameter(50.0, "how far forces typically move the place they act on, mm", minimum=1e-3)
    patch_mm: float = parameter(24.0, "over which length forces act alike, mm", minimum=1e-3)
    fields: int = parameter(20, "how many ways to spread forces over their place", minimum=1)
    loads: int = parameter(40, "random loads from which the reduced model is made", minimum=1)
    model_error_mm: float = parameter(0.3, ERROR_HELP, minimum=1e-3)
    model_error_length_mm: float = parameter(20.0, LENGTH_HELP, minimum=1e-3)


class Forces:
    """Unknown forces on a hyperelastic body, by its compliance in a reduced model, after Mestdagh and Cotin 2022."""

    name: ClassVar[str] = "forces"
    summary: ClassVar[str] = "hyperelastic and held, under unknown forces on a part of the surface"
    Parameters: ClassVar[type[ForcesParameters]] = ForcesParameters

    def __init__(self, parameters: ForcesParameters) -> None:
        self._chosen = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond the core."""
        return ()

    def prepare(self, model: Model, scenario: Scenario | None = None, progress: Progress = silent) -> "PreparedForces":
        """See `Registration`."""
        chosen = self._chosen
        full, patch = FullModel(model, (chosen.held,)), self._patch(model)
        shares = smooth_forces(model.mesh, patch, chosen.patch_mm, chosen.fields)
        body = pulled_body(full, patch, shares, chosen.reach_mm, chosen.loads, progress)
        return PreparedForces(model, ModelError(chosen.model_error_mm, chosen.model_error_length_mm), body)

    def _patch(self, model: Model) -> IntArray:
        held = model.node_set(self._chosen.held)
        if len(held) < 3:
            raise BadInput(f"The node set {self._chosen.held!r} has {len(held)} nodes, which do not hold the organ.")
        nodes = model.node_set(self._chosen.pulled) if self._chosen.pulled else np.unique(model.mesh.boundary()[0])
        patch = np.setdiff1d(nodes, held)
        if len(patch) == 0:
            raise BadInput(f"All nodes of {self._chosen.pulled!r} are held, so that no force can act on them.")
        return patch


class PreparedForces:
    """A held organ with its compliance; see `PreparedRegistration`."""

    def __init__(self, model: Model, error: ModelError, body: PulledBody) -> None:
        self._model, self._error, self._body = model, error, body
        self._places = Places(model)

    def register(
        self, observations: Observations, last: Registered | None = None, progress: Progress = silent
    ) -> Registered:
        """See `PreparedRegistration`."""
        check_observations(self._model, observations)
        if observations.frame != "patient":
            raise BadInput(
                f'The organ is held where the scan has it, so that observations must be in the frame "patient", not in '
                f"{observations.frame!r}."
            )
        body, start = self._body, self._body.at_rest
        if last is not None:
            check_last(self._model, observations, last)
            if last.forces_mn is not None:
                start = body.nearest(last.positions_mm, last.forces_mn)
        found, off = self._fitted(observations, start)
        doubt = contradiction(observations, off, lambda some: not self._fitted(some, body.at_rest)[1])
        positions, spread, forces = body.positions(found.state), force_spread(body, found), body.forces(found.state)
        return outcome(self._model, observations.frame, positions, spread, found.beliefs, doubt, forces)

    def _fitted(self, observations: Observations, start: Pulled) -> tuple[ForceFit, tuple[str, ...]]:
        """The forces fitted, and what does not fit."""
        seen = Seen(self._places, observations, self._error)
        found = fit_forces(self._body, seen, start)
        return found, misfits(seen, found.rows, found.shifts_mm)
