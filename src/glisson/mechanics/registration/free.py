"""Technique "free": true hyperelasticity, without any boundary condition."""

from dataclasses import dataclass
from typing import ClassVar

from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.mechanics.registration.checks import check_observations
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.expected_energy import energy_per_mode_uj
from glisson.mechanics.registration.full_fit import FullFit
from glisson.mechanics.registration.motion import BasisMotion
from glisson.mechanics.registration.outcome import outcome
from glisson.mechanics.registration.placing import RIGID_ERROR, placed
from glisson.mechanics.registration.seen import Seen


@dataclass(frozen=True)
class FreeParameters(ElasticParameters):
    """Parameters of the free body."""

    modes: int = parameter(60, "how many of the least certain ways to move are told", minimum=6)


class Free:
    """Every node may move, at the cost of strain energy; in the spirit of BCF-FEM (Yang et al. 2024)."""

    name: ClassVar[str] = "free"
    summary: ClassVar[str] = "hyperelastic, every node free, no boundary condition"
    Parameters: ClassVar[type[FreeParameters]] = FreeParameters

    def __init__(self, parameters: FreeParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond the core."""
        return ()

    def register(self, model: Model, observations: Observations, progress: Progress = silent) -> Registered:
        """See `Registration`."""
        check_observations(model, observations)
        progress(0.0, "placing the organ")
        rigid = BasisMotion(model.mesh.nodes)
        place = placed(model, observations, Seen(model, observations, RIGID_ERROR), rigid)
        chosen = self._parameters
        seen = Seen(model, observations, chosen.model_error)
        progress(0.4, "deforming the organ")
        full = FullFit(model, seen, energy_per_mode_uj(model, chosen.strain))
        try:
            found = full.fit(rigid.positions(place.fit.state))
            progress(0.8, "how sure it is")
            spread = full.posterior_spread(found, chosen.modes)
        finally:
            full.close()
        return outcome(model, observations.frame, found.positions, spread, found.beliefs, place.ambiguous)
