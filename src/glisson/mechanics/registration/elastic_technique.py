"""What all techniques share that deform the organ."""

from abc import ABC, abstractmethod

import numpy as np

from glisson.core.model import Model
from glisson.core.protocols import Progress, silent
from glisson.core.scenario import Scenario
from glisson.mechanics.registration.basis import ElasticModes
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.expected_energy import energy_per_mode_uj
from glisson.mechanics.registration.motion import BasisMotion
from glisson.mechanics.registration.prepared import Deformable, MovedBody, Prepared

_USUAL_SHARE = 0.1
"""Of the strain energy that `strain` allows; so much is usual in livers 600 to 619 of the sparse-data twin."""


class ElasticTechnique(ABC):
    """Of a technique remains what deforms."""

    def __init__(self, parameters: ElasticParameters) -> None:
        self._chosen = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond the core."""
        return ()

    def prepare(self, model: Model, scenario: Scenario | None = None, progress: Progress = silent) -> Prepared:
        """See `Registration`."""
        progress(None, "preparing the organ")
        body = self._body(model, energy_per_mode_uj(model, self._chosen.strain))
        return Prepared(model, self._chosen.model_error, body)

    @abstractmethod
    def _body(self, model: Model, energy_uj: float) -> Deformable:
        """What deforms.

        `energy_uj` is twice the strain energy that one way of deforming has in the mean.
        """


class ModalTechnique(ElasticTechnique):
    """Deforms by modes, which remain to be made, on top of a rigid motion."""

    def _body(self, model: Model, energy_uj: float) -> Deformable:
        modes = self._modes(model)
        motion = BasisMotion(model.mesh.nodes, modes.basis, np.diag(2.0 * modes.energies_uj / energy_uj))
        return MovedBody(motion, _USUAL_SHARE)

    @abstractmethod
    def _modes(self, model: Model) -> ElasticModes:
        """The modes of a model."""
