"""Technique "linear-basis": the organ turns as one piece and deforms by linear responses to its surface."""

from dataclasses import dataclass
from typing import ClassVar

from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.mechanics.registration.basis import ElasticModes, boundary_responses
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.elastic_technique import ModalTechnique


@dataclass(frozen=True)
class LinearBasisParameters(ElasticParameters):
    """Parameters of the linear basis."""

    controls: int = parameter(45, "number of points of the surface that move", 3, 1000)


class LinearBasis(ModalTechnique):
    """Boundary responses with a strain-energy weight, after Heiselman, Jarnagin and Miga 2020 (LIBR)."""

    name: ClassVar[str] = "linear-basis"
    summary: ClassVar[str] = "linear elastic responses to points of the surface that move"
    Parameters: ClassVar[type[LinearBasisParameters]] = LinearBasisParameters
    _chosen: LinearBasisParameters

    def _modes(self, model: Model) -> ElasticModes:
        return boundary_responses(model, self._chosen.controls)
