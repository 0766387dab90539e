"""Materials that a case can name, each with the source of its stiffness.

All have ν = 0.45 and ρ = 1150 kg/m³ (dissertation, section 4.3, after Haouchine et al.). The dissertation cites
stiffnesses of 6 to 13 kPa (section 1.4) and computes with a hundred times as much; whoever repeats its figures needs
the latter, whoever treats a patient the former.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from glisson.core.model import Material


@dataclass(frozen=True)
class Preset:
    """A material and where its stiffness comes from."""

    material: Material
    source: str


def _liver(young_modulus_kpa: float, law: str = "neo-hookean") -> Material:
    return Material(law, young_modulus_kpa=young_modulus_kpa, poisson_ratio=0.45, density_kg_m3=1150.0)


PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        "human-liver": Preset(_liver(7.0), "human liver, 7 kPa: mean of those the dissertation cites as [36]"),
        "cadaver-liver": Preset(_liver(6.0), "fresh human cadaver, 6 kPa: dissertation, [14]"),
        "pig-liver": Preset(_liver(13.0), "pig, 13 kPa: dissertation, [34]"),
        "dissertation": Preset(_liver(700.0), "0.7 MPa: the dissertation's own model, section 4.3"),
    }
)

HUMAN_LIVER = PRESETS["human-liver"].material
"""The material where none is chosen."""
