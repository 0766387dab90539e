"""Ogden's law in principal stretches (Ogden 1972, Proc. R. Soc. A 326), with a volumetric part of its own.

W = Σ µ_p/α_p (λ̄1^α_p + λ̄2^α_p + λ̄3^α_p − 3) + κ/2 (J − 1)², with λ̄ = J^(−1/3) λ.
"""

from typing import ClassVar

import numpy as np
from numba import njit

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.mechanics.materials.law import PlainLaw

_SUM_TOLERANCE = 1e-6


class Ogden(PlainLaw):
    """Constants beside E and ν: pairs of an exponent α_p and its share of the shear modulus, µ_p α_p / (2 µ)."""

    name: ClassVar[str] = "ogden"
    summary: ClassVar[str] = "hyperelastic in principal stretches; constants = [exponent, share of µ, exponent, …]"

    def check(self, material: Material) -> None:
        """Constants must come in pairs, exponents must not vanish, and shares must sum to 1.

        Raises:
            BadInput: they don't.
        """
        exponents, shares = material.constants[::2], material.constants[1::2]
        paired = len(exponents) == len(shares) > 0
        if not paired or 0.0 in exponents or abs(sum(shares) - 1.0) > _SUM_TOLERANCE:
            raise BadInput(
                "Material law ogden needs pairs of constants, an exponent other than 0 and its share of the shear "
                f"modulus, the shares summing to 1, not {list(material.constants)}."
            )

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """W (n,) in kPa; infinite where J ≤ 0."""
        energy: FloatArray = _energy(gradients, _terms(material), material.bulk_modulus_kpa)
        return energy

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """P = Σ ∂W/∂λ_a u_a ⊗ v_a with F = Σ λ_a u_a ⊗ v_a."""
        stress: FloatArray = _stress(gradients, _terms(material), material.bulk_modulus_kpa)
        return stress

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F; where two stretches coincide, quotients of differences become derivatives."""
        tangent: FloatArray = _tangent(gradients, _terms(material), material.bulk_modulus_kpa)
        return tangent


def _terms(material: Material) -> FloatArray:
    """Rows α_p, µ_p of the sum."""
    pairs = np.array(material.constants).reshape(-1, 2)
    return np.stack([pairs[:, 0], 2.0 * material.shear_modulus_kpa * pairs[:, 1] / pairs[:, 0]], axis=1)


@njit(cache=True, nogil=True)
def _energy(gradients: FloatArray, terms: FloatArray, bulk: float) -> FloatArray:
    energies: FloatArray = np.full(len(gradients), np.inf)
    for n in range(len(gradients)):
        jacobian = np.linalg.det(gradients[n])
        if jacobian <= 0.0:
            continue
        stretches = np.linalg.svd(gradients[n])[1]
        value = 0.5 * bulk * (jacobian - 1.0) ** 2
        for alpha, modulus in terms:
            value += modulus / alpha * ((stretches**alpha).sum() * jacobian ** (-alpha / 3.0) - 3.0)
        energies[n] = value
    return energies


@njit(cache=True, nogil=True)
def _slopes(stretches: FloatArray, terms: FloatArray, bulk: float) -> FloatArray:
    """∂W/∂λ_a, (3,)."""
    jacobian = stretches[0] * stretches[1] * stretches[2]
    slopes: FloatArray = bulk * (jacobian - 1.0) * jacobian / stretches
    for alpha, modulus in terms:
        powers = modulus * jacobian ** (-alpha / 3.0) * stretches**alpha
        slopes += (powers - powers.sum() / 3.0) / stretches
    return slopes


@njit(cache=True, nogil=True)
def _curvatures(stretches: FloatArray, terms: FloatArray, bulk: float) -> FloatArray:
    """∂²W/∂λ_a∂λ_b, (3, 3)."""
    jacobian = stretches[0] * stretches[1] * stretches[2]
    result = np.zeros((3, 3))
    for a in range(3):
        for b in range(3):
            result[a, b] = bulk * (2.0 * jacobian - 1.0) * jacobian
        result[a, a] -= bulk * (jacobian - 1.0) * jacobian
    for alpha, modulus in terms:
        powers = modulus * jacobian ** (-alpha / 3.0) * stretches**alpha
        mean = powers.sum() / 3.0
        for a in range(3):
            for b in range(3):
                result[a, b] -= alpha / 3.0 * (powers[a] + powers[b] - mean)
            result[a, a] += alpha * powers[a] - (powers[a] - mean)
    for a in range(3):
        for b in range(3):
            result[a, b] /= stretches[a] * stretches[b]
    return result


@njit(cache=True, nogil=True)
def _stress(gradients: FloatArray, terms: FloatArray, bulk: float) -> FloatArray:
    stress = np.zeros_like(gradients)
    for n in range(len(gradients)):
        if np.linalg.det(gradients[n]) <= 0.0:
            continue
        left, stretches, right = np.linalg.svd(gradients[n])
        stress[n] = left @ np.diag(_slopes(stretches, terms, bulk)) @ right
    return stress


@njit(cache=True, nogil=True)
def _tangent(gradients: FloatArray, terms: FloatArray, bulk: float) -> FloatArray:
    tangent = np.zeros((len(gradients), 9, 9))
    basis = np.zeros((9, 9))
    for n in range(len(gradients)):
        if np.linalg.det(gradients[n]) <= 0.0:
            continue
        left, stretches, right = np.linalg.svd(gradients[n])
        # Row 3 a + b is u_a ⊗ v_b: in this basis the tangent couples the diagonal, and each entry to its mirror.
        for a in range(3):
            for b in range(3):
                for i in range(3):
                    for j in range(3):
                        basis[3 * a + b, 3 * i + j] = left[i, a] * right[b, j]
        principal = _principal_tangent(stretches, terms, bulk)
        tangent[n] = basis.T @ principal @ basis
    return tangent


@njit(cache=True, nogil=True)
def _principal_tangent(stretches: FloatArray, terms: FloatArray, bulk: float) -> FloatArray:
    """∂P/∂F (9, 9) for a diagonal F."""
    slopes, curvatures = _slopes(stretches, terms, bulk), _curvatures(stretches, terms, bulk)
    result = np.zeros((9, 9))
    for a in range(3):
        for b in range(3):
            result[4 * a, 4 * b] = curvatures[a, b]
            if a == b:
                continue
            apart = stretches[a] - stretches[b]
            if abs(apart) > 1e-4 * stretches[a]:
                symmetric = (slopes[a] - slopes[b]) / apart
            else:  # its limit, up to the square of the difference
                symmetric = 0.5 * (curvatures[a, a] + curvatures[b, b]) - curvatures[a, b]
            antisymmetric = (slopes[a] + slopes[b]) / (stretches[a] + stretches[b])
            result[3 * a + b, 3 * a + b] = 0.5 * (symmetric + antisymmetric)
            result[3 * a + b, 3 * b + a] = 0.5 * (symmetric - antisymmetric)
    return result
