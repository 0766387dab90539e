"""Co-rotational law, W = µ |F − R|² + λ/2 (tr(RᵀF) − 3)² with the rotation R of F = R S.

Linear elasticity in the frame that turns along (Müller and Gross 2004, "Interactive virtual materials");
the exact tangent by the eigenvectors of ∂R/∂F (Smith, De Goes, Kim 2019, "Analytic eigensystems for
isotropic distortion energies", ACM Trans. Graph. 38:3, section 4).
"""

from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Material
from glisson.mechanics.materials.law import PlainLaw

_TWISTS = np.array(
    [
        [[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]],
    ]
) / np.sqrt(2.0)


class CoRotational(PlainLaw):
    """Hooke's law seen from a frame that turns with the tissue."""

    name: ClassVar[str] = "co-rotational"
    summary: ClassVar[str] = "linear elasticity in a frame that turns along"

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """W (n,) in kPa; infinite where J ≤ 0, where R is no longer the turn of the tissue."""
        rotations, _, stretches, _ = _polar(gradients)
        distance = np.sum((gradients - rotations) ** 2, axis=(1, 2))
        growth = stretches.sum(axis=1) - 3.0
        energy = material.shear_modulus_kpa * distance + 0.5 * material.lame_lambda_kpa * growth**2
        return np.where(np.linalg.det(gradients) > 0.0, energy, np.inf)

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """P = 2µ (F − R) + λ (tr(S) − 3) R."""
        rotations, _, stretches, _ = _polar(gradients)
        growth = (stretches.sum(axis=1) - 3.0)[:, None, None]
        stress: FloatArray = 2.0 * material.shear_modulus_kpa * (gradients - rotations)
        stress += material.lame_lambda_kpa * growth * rotations
        return stress

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F = 2µ 1 + λ R ⊗ R + (λ (tr(S) − 3) − 2µ) ∂R/∂F."""
        rotations, left, stretches, right = _polar(gradients)
        turns = np.einsum("nij,tjk,nkl->ntil", left, _TWISTS, right).reshape(-1, 3, 9)
        # A twist about one principal axis is resisted by the stretches along the two others.
        rates = 2.0 / np.maximum(stretches.sum(axis=1, keepdims=True) - stretches, 1e-12)
        turning = np.einsum("nt,nti,ntj->nij", rates, turns, turns)
        flat = rotations.reshape(-1, 9)
        growth = (stretches.sum(axis=1) - 3.0)[:, None, None]
        tangent = 2.0 * material.shear_modulus_kpa * (np.eye(9) - turning)
        tangent += material.lame_lambda_kpa * (flat[:, :, None] * flat[:, None, :] + growth * turning)
        result: FloatArray = tangent
        return result


def _polar(gradients: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """R (n, 3, 3), and U, σ, Vᵀ of F = U σ Vᵀ with R = U Vᵀ a rotation; the last σ has the sign of J."""
    left, stretches, right = np.linalg.svd(gradients)
    flipped = np.linalg.det(left @ right) < 0.0
    left[flipped, :, 2] *= -1.0
    stretches[flipped, 2] *= -1.0
    return left @ right, left, stretches, right
