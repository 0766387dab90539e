"""What all techniques share that deform the organ: placed as one piece first, then deformed from there."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.mechanics.registration.basis import ElasticModes
from glisson.mechanics.registration.checks import check_observations
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.expected_energy import energy_per_mode_uj
from glisson.mechanics.registration.fitting import fit
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.outcome import outcome, posterior_spread
from glisson.mechanics.registration.placing import RIGID_ERROR, placed
from glisson.mechanics.registration.seen import Seen


@dataclass(frozen=True, eq=False)
class Deformed:
    """Nodes (n, 3) now, their posterior spread (n, 3, k), and how far each observed point is believed (p,)."""

    positions: FloatArray
    spread_mm: FloatArray
    beliefs: FloatArray


class ElasticTechnique(ABC):
    """Of a technique remains how it deforms a model to fit what was seen."""

    def __init__(self, parameters: ElasticParameters) -> None:
        self._chosen = parameters

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
        progress(0.4, "deforming the organ")
        seen = Seen(model, observations, self._chosen.model_error)
        found = self._deformed(model, seen, place.fit.state, energy_per_mode_uj(model, self._chosen.strain))
        return outcome(model, observations.frame, found.positions, found.spread_mm, found.beliefs, place.ambiguous)

    @abstractmethod
    def _deformed(self, model: Model, seen: Seen, place: MotionState, energy_uj: float) -> Deformed:
        """The model fitted to what was seen, from a rigid place.

        `energy_uj` is twice the strain energy that one way of deforming has in the mean.
        """


class ModalTechnique(ElasticTechnique):
    """Deforms by modes, which remain to be made, on top of a rigid motion."""

    def _deformed(self, model: Model, seen: Seen, place: MotionState, energy_uj: float) -> Deformed:
        modes = self._modes(model)
        motion = BasisMotion(model.mesh.nodes, modes.basis, np.diag(2.0 * modes.energies_uj / energy_uj))
        found = fit(motion, seen, MotionState(place.rotation, place.shift_mm, np.zeros(motion.size - 6)))
        return Deformed(motion.positions(found.state), posterior_spread(motion, found), found.beliefs)

    @abstractmethod
    def _modes(self, model: Model) -> ElasticModes:
        """The modes of a model."""
