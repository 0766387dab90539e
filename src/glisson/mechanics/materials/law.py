"""What a material law computes, and how the law of a region is found."""

from dataclasses import dataclass
from typing import ClassVar, Protocol

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.core.registry import make_technique


@dataclass(frozen=True)
class NoParameters:
    """A law has no parameters of its own: its constants belong to the region's `Material`."""


class Law(Protocol):
    """Energy, stress and tangent of many deformation gradients F (n, 3, 3) at once, in kPa.

    A law vanishes at F = 1, is frame-indifferent (the small-strain one excepted) and reduces to linear
    elasticity with the material's Young's modulus and Poisson's ratio for small strain.
    """

    def check(self, material: Material) -> None:
        """Whether the material has the constants that the law needs.

        Raises:
            BadInput: it has not.
        """

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """Strain energy density W (n,); infinite where the law has no meaning (J ≤ 0)."""

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """First Piola–Kirchhoff stress P = ∂W/∂F, (n, 3, 3)."""

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F as (n, 9, 9), rows and columns being the row-major entries of P and F."""


class PlainLaw:
    """What every law here shares as a technique: nothing to set, nothing to install."""

    Parameters: ClassVar[type[NoParameters]] = NoParameters

    def __init__(self, parameters: NoParameters) -> None:
        """A law has nothing to set."""

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing is needed."""
        return ()

    def check(self, material: Material) -> None:
        """Most laws need no constants beside E and ν.

        Raises:
            BadInput: the material has some.
        """
        if material.constants:
            raise BadInput(f"Material law {material.law} takes no constants, but there are {list(material.constants)}.")


def find_law(name: str) -> Law:
    """The law registered under `name` in the entry-point group `glisson.materials`.

    Raises:
        BadInput: there is no such law.
    """
    law: Law = make_technique("material", name, {}, f"material law {name}")
    return law
