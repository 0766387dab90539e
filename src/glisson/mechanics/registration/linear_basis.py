"""Technique "linear-basis": the organ turns as one piece and deforms by linear responses to its surface."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.mechanics.registration.basis import boundary_responses
from glisson.mechanics.registration.checks import check_observations
from glisson.mechanics.registration.elastic_fit import elastic_fit
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.expected_energy import energy_per_mode_uj
from glisson.mechanics.registration.motion import BasisMotion


@dataclass(frozen=True)
class LinearBasisParameters(ElasticParameters):
    """Parameters of the linear basis."""

    controls: int = parameter(45, "number of points of the surface that move", minimum=3)


class LinearBasis:
    """Boundary responses with a strain-energy weight, after Heiselman, Jarnagin and Miga 2020 (LIBR)."""

    name: ClassVar[str] = "linear-basis"
    summary: ClassVar[str] = "linear elastic responses to points of the surface that move"
    Parameters: ClassVar[type[LinearBasisParameters]] = LinearBasisParameters

    def __init__(self, parameters: LinearBasisParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond the core."""
        return ()

    def register(self, model: Model, observations: Observations, progress: Progress = silent) -> Registered:
        """See `Registration`."""
        check_observations(model, observations)
        progress(0.0, "responses of the surface")
        chosen = self._parameters
        modes = boundary_responses(model, chosen.controls)
        precision = np.diag(2.0 * modes.energies_uj / energy_per_mode_uj(model, chosen.strain))
        motion = BasisMotion(model.mesh.nodes, modes.basis, precision)
        return elastic_fit(model, observations, motion, chosen.model_error, progress)
