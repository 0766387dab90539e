"""Mooney–Rivlin law, W = C10 (Ī1 − 3) + C01 (Ī2 − 3) + κ/2 (J − 1)² (Rivlin 1948, Phil. Trans. R. Soc. A 241).

Ī1 = J^(−2/3) I1 and Ī2 = J^(−4/3) I2 are the invariants of the volume-preserving part.
"""

from typing import ClassVar

import numpy as np
from numba import njit

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.model import Material
from glisson.mechanics.materials.isotropic import combined_stress, combined_tangent, kinematics
from glisson.mechanics.materials.law import PlainLaw


class MooneyRivlin(PlainLaw):
    """One constant beside E and ν: the share of C01 in C10 + C01 = µ/2, from 0 (neo-Hookean) to 1."""

    name: ClassVar[str] = "mooney-rivlin"
    summary: ClassVar[str] = "hyperelastic with the second invariant; constants = [C01 / (C10 + C01)]"

    def check(self, material: Material) -> None:
        """The share must be there and lie in 0 to 1.

        Raises:
            BadInput: it does not.
        """
        if len(material.constants) != 1 or not 0.0 <= material.constants[0] <= 1.0:
            raise BadInput(
                "Material law mooney-rivlin needs one constant, the share C01 / (C10 + C01) from 0 to 1, not "
                f"{list(material.constants)}."
            )

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """W (n,) in kPa; infinite where J ≤ 0."""
        jacobians, first, _ = kinematics(gradients)
        safe = np.where(jacobians > 0.0, jacobians, 1.0)
        one, two = _constants(material)
        energy = one * (safe ** (-2.0 / 3.0) * first - 3.0)
        energy += two * (safe ** (-4.0 / 3.0) * _second_invariant(gradients, first) - 3.0)
        energy += 0.5 * material.bulk_modulus_kpa * (safe - 1.0) ** 2
        return np.where(jacobians > 0.0, energy, np.inf)

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """P = 2 C10 J^(−2/3) (F − I1/3 G) + 2 C01 J^(−4/3) (I1 F − F C − 2/3 I2 G) + κ (J − 1) J G."""
        jacobians, first, inverse_transposes = kinematics(gradients)
        second, shear, twist = self._scaled(gradients, jacobians, first, material)
        volumetric = material.bulk_modulus_kpa * (jacobians - 1.0) * jacobians
        normal = volumetric - shear * first / 3.0 - 2.0 / 3.0 * twist * second
        result: FloatArray = combined_stress(gradients, inverse_transposes, shear + twist * first, normal)
        right = np.matmul(gradients.transpose(0, 2, 1), gradients)
        result -= twist[:, None, None] * np.matmul(gradients, right)
        return result

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F."""
        jacobians, first, inverse_transposes = kinematics(gradients)
        second, shear, twist = self._scaled(gradients, jacobians, first, material)
        bulk = material.bulk_modulus_kpa
        pressure = bulk * (jacobians - 1.0) * jacobians
        beta = 2.0 / 9.0 * shear * first + bulk * (2.0 * jacobians - 1.0) * jacobians + 8.0 / 9.0 * twist * second
        zeta = shear * first / 3.0 - pressure + 2.0 / 3.0 * twist * second
        result: FloatArray = combined_tangent(
            gradients, inverse_transposes, shear + twist * first, beta, -2.0 / 3.0 * shear, zeta
        )
        _add_second(gradients, inverse_transposes, first, twist, result)
        return result

    def _scaled(
        self, gradients: FloatArray, jacobians: FloatArray, first: FloatArray, material: Material
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """I2, 2 C10 J^(−2/3) and 2 C01 J^(−4/3), each (n,)."""
        safe = np.where(jacobians > 0.0, jacobians, 1.0)
        one, two = _constants(material)
        return _second_invariant(gradients, first), 2.0 * one * safe ** (-2.0 / 3.0), 2.0 * two * safe ** (-4.0 / 3.0)


def _constants(material: Material) -> tuple[float, float]:
    """C10 and C01 in kPa."""
    share = material.constants[0]
    return 0.5 * (1.0 - share) * material.shear_modulus_kpa, 0.5 * share * material.shear_modulus_kpa


def _second_invariant(gradients: FloatArray, first: FloatArray) -> FloatArray:
    """I2 = (I1² − C : C) / 2, (n,)."""
    right = np.matmul(gradients.transpose(0, 2, 1), gradients)
    second: FloatArray = 0.5 * (first**2 - np.einsum("nij,nij->n", right, right))
    return second


@njit(cache=True, nogil=True)
def _add_second(
    gradients: FloatArray, inverse_transposes: FloatArray, first: FloatArray, twist: FloatArray, tangent: FloatArray
) -> None:
    """Add what the second invariant brings beyond `combined_tangent`, with N = I1 F − F C.

    2 C01 J^(−4/3) times 2 F_iJ F_kL − F_iL F_kJ − B_ik δ_JL − δ_ik C_JL − 4/3 (G_iJ N_kL + N_iJ G_kL).
    """
    for n in range(len(first)):
        f, g = gradients[n], inverse_transposes[n]
        right = f.T @ f
        left = f @ f.T
        normal = first[n] * f - f @ right
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    for m in range(3):
                        value = 2.0 * f[i, j] * f[k, m] - f[i, m] * f[k, j]
                        value -= 4.0 / 3.0 * (g[i, j] * normal[k, m] + normal[i, j] * g[k, m])
                        if j == m:
                            value -= left[i, k]
                        if i == k:
                            value -= right[j, m]
                        tangent[n, 3 * i + j, 3 * k + m] += twist[n] * value
