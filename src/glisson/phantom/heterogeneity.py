"""Tissue that is not the same everywhere, as truths have it and the models under test do not know it."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh

VARIATION = 0.15
"""Parenchyma is softer and stiffer by up to this fraction."""

TUMOUR_FACTOR = 3.0
"""A tumour is so many times as stiff as the parenchyma around it."""

_WAVES = np.array([[0.045, 0.03, 0.02], [-0.02, 0.05, 0.06], [0.06, -0.02, -0.035]])
_PHASES = np.array([0.4, 2.1, 4.0])
_SAMPLES = 64

Contains = Callable[[FloatArray], NDArray[np.bool_]]
"""Whether points (..., 3) in mm lie in a tumour, (...)."""


def uneven_moduli(mesh: TetMesh, modulus_kpa: float, tumours: Sequence[Contains]) -> FloatArray:
    """Young's modulus (m,) in kPa of each element: smooth waves, and the tumours by the part that they fill."""
    corners = mesh.nodes[mesh.corners]
    uneven = np.cos(corners.mean(axis=1) @ _WAVES.T + _PHASES).mean(axis=1)
    moduli = modulus_kpa * (1.0 + VARIATION * uneven / np.abs(uneven).max())
    weights = np.random.default_rng(0).dirichlet(np.ones(4), size=_SAMPLES)
    samples = np.einsum("sc,mcd->msd", weights, corners)
    for contains in tumours:
        filled: FloatArray = contains(samples).mean(axis=1)
        moduli *= 1.0 + (TUMOUR_FACTOR - 1.0) * filled
    result: FloatArray = moduli
    return result


def stiffness_levels(moduli_kpa: FloatArray, count: int) -> tuple[IntArray, FloatArray]:
    """The level (m,) of each element among `count` even steps of log stiffness, and each level's mean modulus (k,).

    Levels are renumbered from 0, without those that no element has.
    """
    steps = np.geomspace(moduli_kpa.min() * 0.999, moduli_kpa.max() * 1.001, count + 1)
    _, levels = np.unique(np.digitize(moduli_kpa, steps), return_inverse=True)
    means = np.bincount(levels, weights=moduli_kpa) / np.bincount(levels)
    return levels, means
