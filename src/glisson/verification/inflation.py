"""A thick tube inflated in plane strain, nearly incompressible: inner pressure and outer radius.

For an incompressible neo-Hookean tube r² − R² is the same everywhere, and radial equilibrium gives the pressure as
∫ µ (λ² − λ⁻²) dr / r over the wall, with the hoop stretch λ = r / R (Ogden 1984, "Non-linear elastic deformations",
section 5.3).
"""

import numpy as np
from scipy.integrate import quad

from glisson.core.arrays import FloatArray
from glisson.core.model import Material
from glisson.geometry.boxes import box_mesh
from glisson.verification.bodies import body_of, equilibrium, mapped, reactions
from glisson.verification.check import Case, Check, relative

_NAME = "closed-form/inflation"
_INNER, _OUTER, _LENGTH = 10.0, 20.0, 2.0
_INFLATED = 15.0  # inner radius
_STEPS = 4
_COUNTS = (8, 12, 1)  # across the wall, along a quarter, along the axis


def _quarter(places: FloatArray) -> FloatArray:
    """(share of the wall, share of a quarter, z) to places."""
    radius = _INNER + (_OUTER - _INNER) * places[:, 0]
    angle = 0.5 * np.pi * places[:, 1]
    quarter = np.stack([radius * np.cos(angle), radius * np.sin(angle), places[:, 2]], axis=1)
    return quarter.round(12) + 0.0


def _pressure(shear_kpa: float) -> float:
    """The inner pressure in kPa."""
    growth = _INFLATED**2 - _INNER**2

    def slope(radius: float) -> float:
        square = radius**2 / (radius**2 - growth)
        return shear_kpa * (square - 1.0 / square) / radius

    return float(quad(slope, _INFLATED, np.sqrt(_OUTER**2 + growth))[0])


def _inflation() -> list[Check]:
    material = Material("neo-hookean", 7.0, 0.4999)
    mesh = mapped(box_mesh((1.0, 1.0, _LENGTH), _COUNTS, quadratic=True), _quarter)
    radii = np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 1])
    inner, outer = radii < _INNER + 1e-6, radii > _OUTER - 1e-6
    fixed = np.zeros(mesh.nodes.shape, dtype=bool)
    fixed[:, 2] = True
    fixed[:, :2] = mesh.nodes[:, :2] < 1e-9
    fixed[inner] = True
    body = body_of(mesh, material, fixed)
    positions = np.array(mesh.nodes)
    for reach in np.linspace(_INNER, _INFLATED, _STEPS + 1)[1:]:
        before = np.hypot(positions[:, 0], positions[:, 1])
        after = np.sqrt(before**2 + reach**2 - before[inner].mean() ** 2)
        positions[:, :2] *= (after / before)[:, None]
        positions = equilibrium(body, positions, 1e-8)
    outward = np.einsum("ni,ni->n", reactions(body, positions)[:, :2], mesh.nodes[:, :2] / radii[:, None])
    pressure = outward[inner].sum() / (0.5 * np.pi * _INFLATED * _LENGTH)
    reached = np.hypot(positions[outer, 0], positions[outer, 1]).mean()
    source = "closed form, incompressible"
    return [
        relative(f"{_NAME}/pressure", pressure, _pressure(material.shear_modulus_kpa), 0.005, "kPa", source),
        relative(f"{_NAME}/outer-radius", reached, np.sqrt(_OUTER**2 + _INFLATED**2 - _INNER**2), 0.005, "mm", source),
    ]


CASES = (Case(_NAME, "thick tube inflated by half its inner radius, T10, ν = 0.4999", _inflation, slow=True),)
