"""A law of somebody else is tried before it is used."""

import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.mechanics.materials import law as laws
from glisson.mechanics.materials.neo_hookean import NeoHookean


class TwiceTheStress(NeoHookean):
    def stress(self, gradients, material):
        return 2.0 * super().stress(gradients, material)


class WrongTangent(NeoHookean):
    def tangent(self, gradients, material):
        return 1.01 * super().tangent(gradients, material)


class NoNumber(NeoHookean):
    def energy(self, gradients, material):
        return np.full(len(gradients), np.nan)


@pytest.mark.parametrize(
    ("law", "words"),
    [
        (TwiceTheStress, "its stress is not the derivative of its energy"),
        (WrongTangent, "its tangent is not the derivative of its stress"),
        (NoNumber, "its stress is not the derivative of its energy"),
    ],
)
def test_a_wrong_law_is_told(law, words, monkeypatch):
    monkeypatch.setattr(laws, "find_law", lambda name: law(law.Parameters()))
    with pytest.raises(BadInput, match=f"Material law '{law.__name__}' is wrong: {words}"):
        laws.law_of(Material(law.__name__, 7.0, 0.45))


def test_a_law_that_raises_is_named(monkeypatch):
    class Raises(NeoHookean):
        def stress(self, gradients, material):
            raise KeyError("shear")

    monkeypatch.setattr(laws, "find_law", lambda name: Raises(Raises.Parameters()))
    with pytest.raises(BadInput, match=r"Material law 'raises' fails where it is tried \(KeyError: 'shear'\)"):
        laws.law_of(Material("raises", 7.0, 0.45))


@pytest.mark.parametrize("poisson_ratio", [-0.5, 0.0, 0.3, 0.45, 0.4999, 0.499999])
@pytest.mark.parametrize("young_modulus_kpa", [1e-3, 7.0, 1e6])
@pytest.mark.parametrize(
    ("name", "constants"),
    [
        ("neo-hookean", ()),
        ("neo-hookean-log", ()),
        ("linear-elastic", ()),
        ("co-rotational", ()),
        ("saint-venant-kirchhoff", ()),
        ("mooney-rivlin", (0.3,)),
        ("ogden", (2.0, 0.5, -2.0, 0.5)),
    ],
)
def test_ours_are_right(name, constants, young_modulus_kpa, poisson_ratio):
    assert laws.law_of(Material(name, young_modulus_kpa, poisson_ratio, constants=constants)).name == name
