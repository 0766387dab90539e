"""Technique "free": true hyperelasticity, without any boundary condition."""

from dataclasses import dataclass
from typing import ClassVar

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.elastic_technique import ElasticTechnique
from glisson.mechanics.registration.full_fit import FullFit
from glisson.mechanics.registration.prepared import Deformed
from glisson.mechanics.registration.seen import Seen


@dataclass(frozen=True)
class FreeParameters(ElasticParameters):
    """Parameters of the free body."""

    modes: int = parameter(60, "how many of the least certain ways to move are told", 6, 500)


class Free(ElasticTechnique):
    """Every node may move, at the cost of strain energy; in the spirit of BCF-FEM (Yang et al. 2024)."""

    name: ClassVar[str] = "free"
    summary: ClassVar[str] = "hyperelastic, every node free, no boundary condition"
    Parameters: ClassVar[type[FreeParameters]] = FreeParameters
    _chosen: FreeParameters

    def _body(self, model: Model, energy_uj: float) -> "FreeBody":
        return FreeBody(model, energy_uj, self._chosen.modes)


@dataclass(frozen=True, eq=False)
class FreeBody:
    """A body of which every node may move.

    Args:
        model: the organ.
        energy_uj: see `FullFit`.
        modes: how many of the least certain ways to move are told.
    """

    model: Model
    energy_uj: float
    modes: int

    def fitted(self, seen: Seen, start: FloatArray) -> Deformed:
        """See `Deformable`."""
        full = FullFit(self.model, seen, self.energy_uj)
        try:
            found = full.fit(start)
            spread = full.posterior_spread(found, self.modes)
            return Deformed(found.positions, spread, found.rows, found.shifts_mm, found.beliefs)
        finally:
            full.close()
