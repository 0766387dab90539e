"""Logarithmic neo-Hookean law, W = µ/2 (I1 − 3) − µ ln J + λ/2 (ln J)²."""

from typing import ClassVar

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Material
from glisson.mechanics.materials.isotropic import combined_stress, combined_tangent, kinematics
from glisson.mechanics.materials.law import PlainLaw


class NeoHookeanLog(PlainLaw):
    """The form of Bonet and Wood, Nonlinear Continuum Mechanics, eq. 6.27; public liver data uses it."""

    name: ClassVar[str] = "neo-hookean-log"
    summary: ClassVar[str] = "hyperelastic, logarithmic volume term (Bonet and Wood)"

    def energy(self, gradients: FloatArray, material: Material) -> FloatArray:
        """W (n,) in kPa; infinite where J ≤ 0."""
        jacobians, first, _ = kinematics(gradients)
        logs = _log(jacobians)
        energy = material.shear_modulus_kpa * (0.5 * (first - 3.0) - logs) + 0.5 * material.lame_lambda_kpa * logs**2
        return np.where(jacobians > 0.0, energy, np.inf)

    def stress(self, gradients: FloatArray, material: Material) -> FloatArray:
        """P = µ (F − G) + λ ln J G."""
        jacobians, _, inverse_transposes = kinematics(gradients)
        shear = np.full_like(jacobians, material.shear_modulus_kpa)
        volumetric = material.lame_lambda_kpa * _log(jacobians)
        result: FloatArray = combined_stress(gradients, inverse_transposes, shear, volumetric - shear)
        return result

    def tangent(self, gradients: FloatArray, material: Material) -> FloatArray:
        """∂P/∂F = µ δδ + λ G⊗G + (µ − λ ln J) G_iL G_kJ."""
        jacobians, _, inverse_transposes = kinematics(gradients)
        shear = np.full_like(jacobians, material.shear_modulus_kpa)
        beta = np.full_like(jacobians, material.lame_lambda_kpa)
        zeta = shear - beta * _log(jacobians)
        none = np.zeros_like(jacobians)
        result: FloatArray = combined_tangent(gradients, inverse_transposes, shear, beta, none, zeta)
        return result


def _log(jacobians: FloatArray) -> FloatArray:
    logs: FloatArray = np.log(np.where(jacobians > 0.0, jacobians, 1.0))
    return logs
