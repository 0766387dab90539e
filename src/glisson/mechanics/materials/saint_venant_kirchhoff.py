"""Saint Venant–Kirchhoff law, W = λ/2 tr(E)² + µ E:E with Green's strain E = (FᵀF − 1)/2.

Linear in Green's strain: right for large turns with small strains, too soft in strong compression
(Bonet and Wood 2008, "Nonlinear Continuum Mechanics for Finite Element Analysis", section 6.4.1).
"""

from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Material
from glisson.mechanics.materials.law import PlainLaw


class SaintVenantKirchhoff(PlainLaw):
    """The linear law in terms of Green's strain."""

    name: ClassVar[str] = "saint-venant-kirchhoff"
    summary: ClassVar[str] = "linear in Green's strain: large turns, small strains"

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """W (n,) in kPa; infinite where J ≤ 0, though W itself would stay finite there."""
        strain = _green_strain(gradients)
        trace = np.trace(strain, axis1=1, axis2=2)
        square = np.einsum("nij,nij->n", strain, strain)
        energy = 0.5 * material.lame_lambda_kpa * trace**2 + material.shear_modulus_kpa * square
        return np.where(np.linalg.det(gradients) > 0.0, energy, np.inf)

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """P = F S with S = λ tr(E) 1 + 2µ E."""
        result: FloatArray = gradients @ _second_stress(gradients, material)
        return result

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F = δ_ik S_JL + λ F_iJ F_kL + µ (F_iL F_kJ + (F Fᵀ)_ik δ_JL)."""
        unit = np.eye(3)
        left = gradients @ gradients.transpose(0, 2, 1)
        stress = _second_stress(gradients, material)
        tangent = np.einsum("ik,njl->nijkl", unit, stress)
        tangent += material.lame_lambda_kpa * np.einsum("nij,nkl->nijkl", gradients, gradients)
        tangent += material.shear_modulus_kpa * np.einsum("nil,nkj->nijkl", gradients, gradients)
        tangent += material.shear_modulus_kpa * np.einsum("nik,jl->nijkl", left, unit)
        result: FloatArray = tangent.reshape(-1, 9, 9)
        return result


def _green_strain(gradients: FloatArray) -> FloatArray:
    strain: FloatArray = 0.5 * (gradients.transpose(0, 2, 1) @ gradients - np.eye(3))
    return strain


def _second_stress(gradients: FloatArray, material: Material) -> FloatArray:
    strain = _green_strain(gradients)
    traces = np.trace(strain, axis1=1, axis2=2)[:, None, None]
    stress: FloatArray = material.lame_lambda_kpa * traces * np.eye(3) + 2.0 * material.shear_modulus_kpa * strain
    return stress
