"""Technique "kelvinlets": the organ deforms as endless elastic tissue does under blunt forces."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.geometry.quadratic import straight_boundary
from glisson.geometry.spreading import evenly_spread
from glisson.mechanics.registration.basis import ElasticModes, elastic_modes
from glisson.mechanics.registration.elastic_parameters import ElasticParameters
from glisson.mechanics.registration.elastic_technique import ModalTechnique


@dataclass(frozen=True)
class KelvinletsParameters(ElasticParameters):
    """Parameters of the Kelvinlets."""

    centres: int = parameter(45, "number of places on the surface at which forces act", 3, 1000)
    radius_mm: float = parameter(30.0, "how blunt the forces are, mm", 1.0, 200.0)


class Kelvinlets(ModalTechnique):
    """Regularised Kelvinlets (de Goes and James 2017), superposed as by Ringel et al. 2022."""

    name: ClassVar[str] = "kelvinlets"
    summary: ClassVar[str] = "blunt forces in endless elastic tissue; needs no mesh but places"
    Parameters: ClassVar[type[KelvinletsParameters]] = KelvinletsParameters
    _chosen: KelvinletsParameters

    def _modes(self, model: Model) -> ElasticModes:
        return kelvinlet_modes(model, self._chosen.centres, self._chosen.radius_mm)


def kelvinlet_modes(model: Model, count: int, radius_mm: float) -> ElasticModes:
    """Displacements by forces at places of the surface, and the work that these do."""
    nodes = model.mesh.nodes
    surface = np.unique(straight_boundary(model.mesh)[0])
    centres = nodes[surface[evenly_spread(nodes[surface], count)]]
    material = min(model.materials.values(), key=lambda one: one.young_modulus_kpa)
    shear, ratio = material.shear_modulus_kpa, material.poisson_ratio
    work = kelvinlets(centres, centres, radius_mm, shear, ratio)
    basis = kelvinlets(nodes, centres, radius_mm, shear, ratio)
    size = 3 * len(centres)
    return elastic_modes(
        basis.transpose(0, 2, 1, 3).reshape(len(nodes), 3, size), work.transpose(0, 2, 1, 3).reshape(size, size)
    )


def kelvinlets(
    points_mm: FloatArray, centres_mm: FloatArray, radius_mm: float, shear_kpa: float, ratio: float
) -> FloatArray:
    """Displacement (n, c, 3, 3) in mm at points (n, 3) by each unit force (1 mN) at centres (c, 3).

    de Goes and James 2017, equation 6, of a force spread over about `radius_mm`.
    """
    arms = points_mm[:, None] - centres_mm[None]
    reach = np.sqrt((arms**2).sum(axis=2) + radius_mm**2)[:, :, None, None]
    a = 1.0 / (4.0 * np.pi * shear_kpa)
    b = a / (4.0 * (1.0 - ratio))
    outer = arms[:, :, :, None] * arms[:, :, None, :]
    result: FloatArray = ((a - b) / reach + 0.5 * a * radius_mm**2 / reach**3) * np.eye(3) + b / reach**3 * outer
    return result
