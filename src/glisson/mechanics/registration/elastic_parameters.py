"""What all techniques that deform the organ can be told."""

from dataclasses import dataclass

from glisson.core.parameters import parameter
from glisson.mechanics.registration.seen import ModelError

ERROR_HELP = "how far the model cannot follow the organ, mm"
LENGTH_HELP = "over which length points are off alike by the model's error, mm"


@dataclass(frozen=True)
class ElasticParameters:
    """How much deformation is expected, and how good the model is."""

    strain: float = parameter(0.1, "typical strain that is expected of the organ", minimum=1e-4)
    model_error_mm: float = parameter(1.0, ERROR_HELP, minimum=1e-3)
    model_error_length_mm: float = parameter(20.0, LENGTH_HELP, minimum=1e-3)

    @property
    def model_error(self) -> ModelError:
        """Both numbers of it."""
        return ModelError(self.model_error_mm, self.model_error_length_mm)
