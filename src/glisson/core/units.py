"""The one place where units are converted, and how people read a place.

Inside, one consistent set: mm, kPa, mN, s, radians (so mass is in kg, energy in µJ, and
1 kPa·mm² = 1 mN). People read and write mm, kPa, N, kg/m³ and degrees.
"""

from collections.abc import Iterable
from math import degrees, radians

STANDARD_GRAVITY_MM_S2 = 9806.65
"""Standard acceleration of gravity (CGPM 1901) in mm/s²."""


def density_from_kg_m3(density_kg_m3: float) -> float:
    """Density in kg/mm³, so that density × acceleration (mm/s²) is a body force in mN/mm³."""
    return density_kg_m3 * 1e-9


def newtons_from_millinewtons(force_mn: float) -> float:
    """Force in N from mN."""
    return force_mn * 1e-3


def millinewtons_from_newtons(force_n: float) -> float:
    """Force in mN from N."""
    return force_n * 1e3


def newton_metres_from_internal(moment_mn_mm: float) -> float:
    """Moment in N·m from mN·mm."""
    return moment_mn_mm * 1e-6


def millilitres_from_mm3(volume_mm3: float) -> float:
    """Volume in ml from mm³."""
    return volume_mm3 * 1e-3


def place_text(point_mm: Iterable[float]) -> str:
    """A place for people, to the millimetre: "(12, -5, 130) mm"."""
    return "(" + ", ".join(f"{coordinate:.0f}" for coordinate in point_mm) + ") mm"


__all__ = [
    "STANDARD_GRAVITY_MM_S2",
    "degrees",
    "density_from_kg_m3",
    "millilitres_from_mm3",
    "millinewtons_from_newtons",
    "newton_metres_from_internal",
    "newtons_from_millinewtons",
    "place_text",
    "radians",
]
