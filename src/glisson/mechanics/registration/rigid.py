"""Technique "rigid": the organ moves as one piece."""

from dataclasses import dataclass
from typing import ClassVar

from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.mechanics.registration.checks import check_observations
from glisson.mechanics.registration.elastic_parameters import ERROR_HELP, LENGTH_HELP
from glisson.mechanics.registration.motion import BasisMotion
from glisson.mechanics.registration.outcome import outcome, posterior_spread
from glisson.mechanics.registration.placing import RIGID_ERROR, placed
from glisson.mechanics.registration.seen import ModelError, Seen


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

    def register(self, model: Model, observations: Observations, progress: Progress = silent) -> Registered:
        """See `Registration`."""
        check_observations(model, observations)
        progress(None, "placing the organ")
        error = ModelError(self._parameters.model_error_mm, self._parameters.model_error_length_mm)
        motion = BasisMotion(model.mesh.nodes)
        found = placed(model, observations, Seen(model, observations, error), motion)
        positions, spread = motion.positions(found.fit.state), posterior_spread(motion, found.fit)
        return outcome(model, observations.frame, positions, spread, found.fit.beliefs, found.ambiguous)
