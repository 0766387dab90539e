"""Hyperelastic bodies in homogeneous deformations against closed forms, which any mesh must give exactly.

The laws have the volumetric part κ/2 (J − 1)²; `first_stress` writes their stress down anew, apart from the laws
under test.
"""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from scipy.optimize import brentq

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.geometry.boxes import box_mesh
from glisson.verification.bodies import body_of, distorted, equilibrium, material_of, reactions
from glisson.verification.check import Case, Check, relative

_SIZES = (20.0, 10.0, 10.0)
_SOURCE = "closed form of the law"


def first_stress(gradient: FloatArray, material: Material) -> FloatArray:
    """P (3, 3) in kPa by σ = dev(s) / J + κ (J − 1) 1 and P = J σ F⁻ᵀ, s depending on the law and on b̄ = J^(−2/3) b."""
    jacobian = float(np.linalg.det(gradient))
    isochoric = jacobian ** (-2.0 / 3.0) * gradient @ gradient.T
    pull = _PULLS[material.law](isochoric, material)
    cauchy = (pull - np.trace(pull) / 3.0 * np.eye(3)) / jacobian
    cauchy += material.bulk_modulus_kpa * (jacobian - 1.0) * np.eye(3)
    stress: FloatArray = jacobian * cauchy @ np.linalg.inv(gradient).T
    return stress


def _neo_hookean(isochoric: FloatArray, material: Material) -> FloatArray:
    """µ b̄."""
    return material.shear_modulus_kpa * isochoric


def _mooney_rivlin(isochoric: FloatArray, material: Material) -> FloatArray:
    """2 (C10 + C01 Ī1) b̄ − 2 C01 b̄²."""
    second = material.constants[0] * material.shear_modulus_kpa  # 2 C01
    first = material.shear_modulus_kpa - second
    pull: FloatArray = (first + second * np.trace(isochoric)) * isochoric - second * isochoric @ isochoric
    return pull


def _ogden(isochoric: FloatArray, material: Material) -> FloatArray:
    """Σ µ_p b̄^(α_p/2)."""
    values, vectors = np.linalg.eigh(isochoric)
    principal = np.zeros(3)
    for alpha, share in np.reshape(material.constants, (-1, 2)):
        principal += 2.0 * material.shear_modulus_kpa * share / alpha * values ** (alpha / 2.0)
    pull: FloatArray = (vectors * principal) @ vectors.T
    return pull


_PULLS = {"neo-hookean": _neo_hookean, "mooney-rivlin": _mooney_rivlin, "ogden": _ogden}


def _mesh(quadratic: bool) -> TetMesh:
    mesh = distorted(box_mesh(_SIZES, (4, 2, 2)), 0.8)
    return mesh.as_quadratic() if quadratic else mesh


def uniaxial(stretch: float, material: Material) -> tuple[float, float]:
    """Lateral stretch and pull per unloaded area (kPa) of a bar with free sides."""

    def across(side: float) -> float:
        return float(first_stress(np.diag([stretch, side, side]), material)[1, 1])

    side = float(brentq(across, 0.5, 1.5, xtol=1e-14))
    return side, float(first_stress(np.diag([stretch, side, side]), material)[0, 0])


def _uniaxial(name: str, law: str, quadratic: bool, stretch: float) -> list[Check]:
    """A bar between plates that are drawn apart or together, its sides free."""
    material = material_of(law)
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


def _shear(name: str, law: str, quadratic: bool) -> list[Check]:
    """A block sheared by its boundary: shear force and the normal forces that shear needs (Poynting)."""
    material = material_of(law)
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


def _equibiaxial(name: str, law: str, stretch: float) -> list[Check]:
    """A sheet drawn equally along both its sides, its faces free."""
    material = material_of(law)

    def across(thickness: float) -> float:
        return float(first_stress(np.diag([stretch, stretch, thickness]), material)[2, 2])

    thickness = float(brentq(across, 0.3, 1.5, xtol=1e-14))
    pull = float(first_stress(np.diag([stretch, stretch, thickness]), material)[0, 0])
    mesh = _mesh(quadratic=True)
    far = mesh.nodes > np.array(_SIZES) - 1e-9
    fixed = mesh.nodes < 1e-9
    fixed[:, :2] |= far[:, :2]
    body = body_of(mesh, material, fixed)
    end = equilibrium(body, mesh.nodes * [stretch, stretch, 1.02 * thickness], tolerance=1e-12)
    force = reactions(body, end)[far[:, 0], 0].sum()
    return [
        relative(f"{name}/force", force, pull * _SIZES[1] * _SIZES[2], 1e-8, "mN", _SOURCE),
        relative(f"{name}/thickness", np.ptp(end[:, 2]), _SIZES[2] * thickness, 1e-8, "mm", _SOURCE),
    ]


def _name(kind: str, law: str, element: str) -> str:
    return f"closed-form/{kind}/{element}" if law == "neo-hookean" else f"closed-form/{kind}/{law}/{element}"


def _cases(law: str, elements: Sequence[str]) -> Iterator[Case]:
    for element in elements:
        for kind, stretch in (("tension", 1.3), ("compression", 0.7)):
            name = f"{_name('uniaxial', law, element)}/{kind}"
            what = f"bar with free sides stretched by {stretch:g}, {law}, {element}, ν = 0.45"
            yield Case(name, what, partial(_uniaxial, name, law, element == "T10", stretch))
        name = _name("shear", law, element)
        yield Case(
            name, f"simple shear of 0.6, {law}, {element}, ν = 0.45", partial(_shear, name, law, element == "T10")
        )
    name = _name("equibiaxial", law, "T10")
    yield Case(name, f"sheet stretched by 1.3 both ways, {law}, T10, ν = 0.45", partial(_equibiaxial, name, law, 1.3))


CASES = (*_cases("neo-hookean", ("T4", "T10")), *_cases("mooney-rivlin", ("T10",)), *_cases("ogden", ("T10",)))
