"""Technique "rigid": the organ moves as one piece."""

from dataclasses import dataclass
from typing import ClassVar

from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.scenario import Scenario
from glisson.mechanics.registration.elastic_parameters import ERROR_HELP, LENGTH_HELP
from glisson.mechanics.registration.motion import BasisMotion
from glisson.mechanics.registration.placing import RIGID_ERROR
from glisson.mechanics.registration.prepared import MovedBody, Prepared
from glisson.mechanics.registration.seen import ModelError


@dataclass(frozen=True)
class RigidParameters:
    """Parameters of the rigid organ."""

    model_error_mm: float = parameter(RIGID_ERROR.sigma_mm, ERROR_HELP, minimum=1e-3)
    model_error_length_mm: float = parameter(RIGID_ERROR.length_mm, LENGTH_HELP, minimum=1e-3)


class Rigid:
    """Iterated closest points from everywhere, weighted by feature, then least squares with outliers."""

    name: ClassVar[str] = "rigid"
    summary: ClassVar[str] = "the organ as one piece, found without a guess"
    Parameters: ClassVar[type[RigidParameters]] = RigidParameters

    def __init__(self, parameters: RigidParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond the core."""
        return ()

    def prepare(self, model: Model, scenario: Scenario | None = None, progress: Progress = silent) -> Prepared:
        """See `Registration`."""
        error = ModelError(self._parameters.model_error_mm, self._parameters.model_error_length_mm)
        return Prepared(model, error, MovedBody(BasisMotion(model.mesh.nodes)))
