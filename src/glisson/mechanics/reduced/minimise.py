"""Newton's method with an energy line search, for the full and for the reduced unknowns."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from glisson.core.arrays import FloatArray

_ARMIJO = 1e-4
_HALVINGS = 30
_ROUND_OFF = 1e-12  # share of the energy that rounding may take, …
_STRAIN_ROUND_OFF = 1e-15  # … and of Young's modulus times volume, in strain energies that are small differences


def rounding_uj(young_modulus_kpa: float, volume_mm3: float) -> float:
    """By how much strain energies are uncertain in µJ, by rounding alone."""
    return _STRAIN_ROUND_OFF * young_modulus_kpa * volume_mm3


class Potential(Protocol):
    """An energy over unknowns (of any shape) with its derivatives."""

    rounding: float
    """By how much energies are uncertain, in µJ."""

    def energy(self, unknowns: FloatArray) -> float:
        """In µJ; infinite where an element is inverted."""

    def gradient(self, unknowns: FloatArray) -> FloatArray:
        """Of the energy, in the unknowns' shape."""

    def step(self, unknowns: FloatArray, gradient: FloatArray) -> FloatArray:
        """Newton's step; where the tangent is not positive definite, with one that was made so."""

    def residual(self, unknowns: FloatArray, gradient: FloatArray) -> float:
        """The gradient as a share of the largest force."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where the iteration ended, with what residual; it has `converged` or ran out of iterations."""

    unknowns: FloatArray
    iterations: int
    residual: float
    converged: bool


def minimise(potential: Potential, start: FloatArray, tolerance: float, limit: int) -> Minimum:
    """Follow Newton's steps from `start` until the residual is below the tolerance."""
    unknowns, energy = start, potential.energy(start)
    for iteration in range(limit + 1):
        gradient = potential.gradient(unknowns)
        residual = potential.residual(unknowns, gradient)
        if residual <= tolerance:
            return Minimum(unknowns, iteration, residual, True)
        if iteration == limit:
            break
        step = potential.step(unknowns, gradient)
        slope = float(np.vdot(gradient, step))
        share = 1.0
        for _ in range(_HALVINGS):
            moved = unknowns + share * step
            reached = potential.energy(moved)
            if reached <= energy + _ARMIJO * share * slope + _ROUND_OFF * abs(energy) + potential.rounding:
                break
            share *= 0.5
        else:
            break
        unknowns, energy = moved, reached
    return Minimum(unknowns, iteration, residual, False)
