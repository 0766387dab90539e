"""Neo-Hookean bodies in homogeneous deformations against closed forms, which any mesh must give exactly.

W = µ/2 (J^(−2/3) I1 − 3) + κ/2 (J − 1)²; `first_stress` writes its stress down anew, apart from the law under test.
"""

from functools import partial

import numpy as np
from scipy.optimize import brentq

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.verification.bodies import body_of, box_mesh, distorted, equilibrium, reactions
from glisson.verification.check import Case, Check, relative

_SIZES = (20.0, 10.0, 10.0)
_SOURCE = "closed form of the split neo-Hookean law"


def first_stress(gradient: FloatArray, material: Material) -> FloatArray:
    """P (3, 3) in kPa by σ = µ J^(−5/3) dev(b) + κ (J − 1) 1 and P = J σ F⁻ᵀ."""
    jacobian = float(np.linalg.det(gradient))
    left = gradient @ gradient.T
    deviator = left - np.trace(left) / 3.0 * np.eye(3)
    cauchy = material.shear_modulus_kpa * jacobian ** (-5.0 / 3.0) * deviator
    cauchy += material.bulk_modulus_kpa * (jacobian - 1.0) * np.eye(3)
    stress: FloatArray = jacobian * cauchy @ np.linalg.inv(gradient).T
    return stress


def _mesh(quadratic: bool) -> TetMesh:
    mesh = distorted(box_mesh(_SIZES, (4, 2, 2)), 0.8)
    return mesh.as_quadratic() if quadratic else mesh


def uniaxial(stretch: float, material: Material) -> tuple[float, float]:
    """Lateral stretch and pull per unloaded area (kPa) of a bar with free sides."""

    def across(side: float) -> float:
        return float(first_stress(np.diag([stretch, side, side]), material)[1, 1])

    side = float(brentq(across, 0.5, 1.5, xtol=1e-14))
    return side, float(first_stress(np.diag([stretch, side, side]), material)[0, 0])


def _uniaxial(name: str, quadratic: bool, stretch: float) -> list[Check]:
    """A bar between plates that are drawn apart or together, its sides free."""
    material = Material("neo-hookean", 7.0, 0.45)
    side, pull = uniaxial(stretch, material)
    mesh = _mesh(quadratic)
    far = mesh.nodes[:, 0] > _SIZES[0] - 1e-9
    fixed = mesh.nodes < 1e-9
    fixed[far, 0] = True
    body = body_of(mesh, material, fixed)
    end = equilibrium(body, mesh.nodes * [stretch, 1.02 * side, 0.98 * side], tolerance=1e-12)
    force = reactions(body, end)[far, 0].sum()
    return [
        relative(f"{name}/force", force, pull * _SIZES[1] * _SIZES[2], 1e-8, "mN", _SOURCE),
        relative(f"{name}/width", np.ptp(end[:, 1]), _SIZES[1] * side, 1e-8, "mm", _SOURCE),
    ]


def _shear(name: str, quadratic: bool) -> list[Check]:
    """A block sheared by its boundary: shear force and the normal forces that shear needs (Poynting)."""
    material = Material("neo-hookean", 7.0, 0.45)
    gradient = np.eye(3)
    gradient[0, 2] = 0.6
    stress = first_stress(gradient, material)
    mesh = _mesh(quadratic)
    outside = (np.abs(mesh.nodes / _SIZES - 0.5) > 0.5 - 1e-9).any(axis=1, keepdims=True)
    body = body_of(mesh, material, np.repeat(outside, 3, axis=1))
    sheared = mesh.nodes @ gradient.T
    start = np.where(outside, sheared, mesh.nodes + 0.9 * (sheared - mesh.nodes))
    end = equilibrium(body, start, tolerance=1e-12)
    # Σ f ⊗ X over the boundary is the mean of P times the volume.
    mean = reactions(body, end).T @ mesh.nodes / np.prod(_SIZES)
    return [
        relative(f"{name}/shear", mean[0, 2], stress[0, 2], 1e-8, "kPa", _SOURCE),
        relative(f"{name}/normal", mean[2, 2], stress[2, 2], 1e-8, "kPa", _SOURCE),
        relative(f"{name}/side", mean[1, 1], stress[1, 1], 1e-8, "kPa", _SOURCE),
    ]


CASES = (
    *(
        Case(
            f"closed-form/uniaxial/{element}/{kind}",
            f"bar with free sides stretched by {stretch:g}, {element}, ν = 0.45",
            partial(_uniaxial, f"closed-form/uniaxial/{element}/{kind}", element == "T10", stretch),
        )
        for element in ("T4", "T10")
        for kind, stretch in (("tension", 1.3), ("compression", 0.7))
    ),
    *(
        Case(
            f"closed-form/shear/{element}",
            f"simple shear of 0.6, {element}, ν = 0.45",
            partial(_shear, f"closed-form/shear/{element}", element == "T10"),
        )
        for element in ("T4", "T10")
    ),
)
