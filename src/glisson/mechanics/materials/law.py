"""What material laws share, and how the law of a region is found."""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.core.protocols import MaterialLaw
from glisson.core.registry import make_technique

_TRIALS = np.eye(3) + np.array(
    [
        [[0.02, 0.01, 0.0], [-0.01, -0.01, 0.03], [0.0, 0.02, 0.01]],
        [[0.10, 0.05, -0.04], [0.02, -0.08, 0.06], [0.03, -0.05, 0.04]],
        [[-0.12, 0.20, 0.00], [0.05, 0.15, -0.10], [0.08, 0.02, 0.05]],
    ]
)
"""Deformation gradients (n, 3, 3), from small strain to some 20 %."""

_STEP = 1e-5  # of the differences
_APART = 1e-4  # share of the modulus, or of what is larger, that rounding may leave


@dataclass(frozen=True)
class NoParameters:
    """A law has no parameters of its own: its constants belong to the region's `Material`."""


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


def find_law(name: str) -> MaterialLaw:
    """The law registered under `name` in the entry-point group `glisson.materials`.

    Raises:
        BadInput: there is no such law.
    """
    law: MaterialLaw = make_technique("material", name, {}, f"material law {name}")
    return law


@lru_cache(maxsize=64)
def law_of(material: Material) -> MaterialLaw:
    """The law of a material, tried on a few deformations: whoever writes one may slip.

    Raises:
        BadInput: there is no such law, the material lacks its constants, or its stress or tangent is not the
            derivative that it has to be.
    """
    law = find_law(material.law)
    law.check(material)
    try:
        power, slope, rate, change = _derivatives(law, material)
    except Exception as error:  # a law from outside may raise anything
        reason = f"{type(error).__name__}: {error}"
        raise BadInput(f"Material law {material.law!r} fails where it is tried ({reason}).") from error
    for what, found, expected in (("stress", power, slope), ("tangent", rate, change)):
        apart = float(np.abs(found - expected).max())
        if not apart <= _APART * max(material.young_modulus_kpa, float(np.abs(expected).max())):
            of = "energy" if what == "stress" else "stress"
            raise BadInput(f"Material law {material.law!r} is wrong: its {what} is not the derivative of its {of}.")
    return law


def _derivatives(law: MaterialLaw, material: Material) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Along a direction: power (n,) and energy's slope (n,), tangent's rate (n, 3, 3) and stress's change (n, 3, 3)."""
    across = np.random.default_rng(0).normal(size=_TRIALS.shape)
    ahead, behind = _TRIALS + _STEP * across, _TRIALS - _STEP * across
    with np.errstate(all="ignore"):
        power = np.einsum("nij,nij->n", law.stress(_TRIALS, material), across)
        slope = (law.energy(ahead, material) - law.energy(behind, material)) / (2.0 * _STEP)
        rate = np.einsum("nab,nb->na", law.tangent(_TRIALS, material), across.reshape(-1, 9)).reshape(-1, 3, 3)
        change = (law.stress(ahead, material) - law.stress(behind, material)) / (2.0 * _STEP)
    return power, slope, rate, change
