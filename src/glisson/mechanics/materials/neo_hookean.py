"""Split neo-Hookean law, W = µ/2 (J^(−2/3) I1 − 3) + κ/2 (J − 1)² (dissertation 2.19, sign corrected)."""

from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Material
from glisson.mechanics.materials.isotropic import combined_stress, combined_tangent, kinematics
from glisson.mechanics.materials.law import PlainLaw


class NeoHookean(PlainLaw):
    """The dissertation's law with C1 = µ/2, D1 = κ/2: volume-preserving and volumetric parts are separate."""

    name: ClassVar[str] = "neo-hookean"
    summary: ClassVar[str] = "hyperelastic, volumetric part separate (dissertation, eq. 2.19)"

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """W (n,) in kPa; infinite where J ≤ 0, though (J − 1)² alone would stay finite there."""
        jacobians, first, _ = kinematics(gradients)
        safe = np.where(jacobians > 0.0, jacobians, 1.0)
        energy = 0.5 * material.shear_modulus_kpa * (safe ** (-2.0 / 3.0) * first - 3.0)
        energy += 0.5 * material.bulk_modulus_kpa * (safe - 1.0) ** 2
        return np.where(jacobians > 0.0, energy, np.inf)

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """P = µ J^(−2/3) (F − I1/3 G) + κ (J − 1) J G."""
        jacobians, first, inverse_transposes = kinematics(gradients)
        shear = _scaled_shear(jacobians, material)
        volumetric = material.bulk_modulus_kpa * (jacobians - 1.0) * jacobians
        result: FloatArray = combined_stress(gradients, inverse_transposes, shear, volumetric - shear * first / 3.0)
        return result

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F; the derivative of J^(−2/3) couples F and G."""
        jacobians, first, inverse_transposes = kinematics(gradients)
        shear = _scaled_shear(jacobians, material)
        bulk = material.bulk_modulus_kpa
        beta = 2.0 / 9.0 * shear * first + bulk * (2.0 * jacobians - 1.0) * jacobians
        zeta = shear * first / 3.0 - bulk * (jacobians - 1.0) * jacobians
        result: FloatArray = combined_tangent(gradients, inverse_transposes, shear, beta, -2.0 / 3.0 * shear, zeta)
        return result


def _scaled_shear(jacobians: FloatArray, material: Material) -> FloatArray:
    safe = np.where(jacobians > 0.0, jacobians, 1.0)
    scaled: FloatArray = material.shear_modulus_kpa * safe ** (-2.0 / 3.0)
    return scaled
