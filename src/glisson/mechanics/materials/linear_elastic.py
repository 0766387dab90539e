"""Small-strain linear elasticity (dissertation 2.14 to 2.16): σ = λ tr(ε) 1 + 2µ ε."""

from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Material
from glisson.mechanics.materials.law import PlainLaw


class LinearElastic(PlainLaw):
    """Linear in the displacement gradient: cheap, and wrong wherever the organ turns."""

    name: ClassVar[str] = "linear-elastic"
    summary: ClassVar[str] = "small strain, not frame-indifferent (dissertation, eq. 2.16)"

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """W = λ/2 tr(ε)² + µ ε:ε, (n,) in kPa."""
        strain = _strain(gradients)
        trace = np.trace(strain, axis1=1, axis2=2)
        square = np.einsum("nij,nij->n", strain, strain)
        energy: FloatArray = 0.5 * material.lame_lambda_kpa * trace**2 + material.shear_modulus_kpa * square
        return energy

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """P = σ, the configurations not being told apart."""
        strain = _strain(gradients)
        stress: FloatArray = 2.0 * material.shear_modulus_kpa * strain
        stress += material.lame_lambda_kpa * np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        return stress

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """The constant stiffness λ δ_iJ δ_kL + µ (δ_ik δ_JL + δ_iL δ_kJ)."""
        unit = np.eye(3)
        symmetric = np.einsum("ik,jl->ijkl", unit, unit) + np.einsum("il,kj->ijkl", unit, unit)
        stiffness = material.shear_modulus_kpa * symmetric
        stiffness += material.lame_lambda_kpa * np.einsum("ij,kl->ijkl", unit, unit)
        return np.tile(stiffness.reshape(9, 9), (len(gradients), 1, 1))


def _strain(gradients: FloatArray) -> FloatArray:
    return 0.5 * (gradients + gradients.transpose(0, 2, 1)) - np.eye(3)
