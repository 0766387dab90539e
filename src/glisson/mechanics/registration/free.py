"""Technique "free": true hyperelasticity, without any boundary condition."""

from dataclasses import dataclass
from typing import ClassVar

from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.elastic_technique import Deformed, ElasticTechnique
from glisson.mechanics.registration.full_fit import FullFit
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.seen import Seen


@dataclass(frozen=True)
class FreeParameters(ElasticParameters):
    """Parameters of the free body."""

    modes: int = parameter(60, "how many of the least certain ways to move are told", minimum=6)


class Free(ElasticTechnique):
    """Every node may move, at the cost of strain energy; in the spirit of BCF-FEM (Yang et al. 2024)."""

    name: ClassVar[str] = "free"
    summary: ClassVar[str] = "hyperelastic, every node free, no boundary condition"
    Parameters: ClassVar[type[FreeParameters]] = FreeParameters
    _chosen: FreeParameters

    def _deformed(self, model: Model, seen: Seen, place: MotionState, energy_uj: float) -> Deformed:
        full = FullFit(model, seen, energy_uj)
        try:
            found = full.fit(BasisMotion(model.mesh.nodes).positions(place))
            return Deformed(found.positions, full.posterior_spread(found, self._chosen.modes), found.beliefs)
        finally:
            full.close()
