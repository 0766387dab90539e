"""What compressible neo-Hookean laws share: P = a F + b G and its tangent, with G = F⁻ᵀ."""

import numpy as np
from numba import njit

from glisson.core.arrays import FloatArray


@njit(cache=True, nogil=True)
def kinematics(gradients: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """J = det F (n,), I1 = F : F (n,) and G = F⁻ᵀ (n, 3, 3); G is zero where J ≤ 0."""
    count = gradients.shape[0]
    jacobians = np.zeros(count)
    first = np.zeros(count)
    inverse_transposes = np.zeros((count, 3, 3))
    for n in range(count):
        f = gradients[n]
        g = inverse_transposes[n]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            for c in range(3):
                d, e = (c + 1) % 3, (c + 2) % 3
                g[i, c] = f[j, d] * f[k, e] - f[j, e] * f[k, d]
                first[n] += f[i, c] * f[i, c]
        jacobians[n] = f[0, 0] * g[0, 0] + f[0, 1] * g[0, 1] + f[0, 2] * g[0, 2]
        scale = 1.0 / jacobians[n] if jacobians[n] > 0.0 else 0.0
        g *= scale
    return jacobians, first, inverse_transposes


@njit(cache=True, nogil=True)
def combined_stress(gradients: FloatArray, inverse_transposes: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """P = a F + b G, (n, 3, 3); `a` and `b` are (n,)."""
    stress = np.zeros_like(gradients)
    for n in range(len(a)):
        stress[n] = a[n] * gradients[n] + b[n] * inverse_transposes[n]
    return stress


@njit(cache=True, nogil=True)
def combined_tangent(
    gradients: FloatArray,
    inverse_transposes: FloatArray,
    alpha: FloatArray,
    beta: FloatArray,
    gamma: FloatArray,
    zeta: FloatArray,
) -> FloatArray:
    """α δ_ik δ_JL + β G_iJ G_kL + γ (F_iJ G_kL + G_iJ F_kL) + ζ G_iL G_kJ as (n, 9, 9)."""
    tangent = np.zeros((len(alpha), 9, 9))
    for n in range(len(alpha)):
        f, g = gradients[n], inverse_transposes[n]
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    for m in range(3):
                        value = beta[n] * g[i, j] * g[k, m] + zeta[n] * g[i, m] * g[k, j]
                        value += gamma[n] * (f[i, j] * g[k, m] + g[i, j] * f[k, m])
                        if i == k and j == m:
                            value += alpha[n]
                        tangent[n, 3 * i + j, 3 * k + m] = value
    return tangent
