"""The potential of a load over the modes."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.contact import ReducedContact
from glisson.mechanics.reduced.points import ElasticPoints


class ReducedPotential:
    """Energy, gradient and Newton's step over modal displacements (r,).

    Args:
        points: where the elastic energy is taken.
        dead: (r,) dead forces on the modes.
        contact: the tool, if there is one.
    """

    def __init__(self, points: ElasticPoints, dead: FloatArray, contact: ReducedContact | None) -> None:
        self._points, self._dead, self._contact = points, dead, contact

    def energy(self, modal: FloatArray) -> float:
        """In µJ; infinite where a chosen element is inverted."""
        energy = self._points.energy(modal) - float(self._dead @ modal)
        if self._contact is not None and np.isfinite(energy):
            energy += self._contact.energy(modal)
        return energy

    def gradient(self, modal: FloatArray) -> FloatArray:
        """What is unbalanced (r,)."""
        gradient = self._points.forces(modal) - self._dead
        if self._contact is not None:
            gradient -= self._contact.forces(modal)
        return gradient

    def step(self, modal: FloatArray, gradient: FloatArray) -> FloatArray:
        """Newton's step (r,); the exact stiffness where it is positive definite."""
        try:
            return self._solved(modal, gradient, project=False)
        except np.linalg.LinAlgError:
            return self._solved(modal, gradient, project=True)

    def _solved(self, modal: FloatArray, gradient: FloatArray, project: bool) -> FloatArray:
        matrix = self.stiffness(modal, project)
        factor = cho_factor(matrix, overwrite_a=True, check_finite=False)
        step: FloatArray = cho_solve(factor, -gradient, check_finite=False)
        return step

    def stiffness(self, modal: FloatArray, project: bool) -> FloatArray:
        """∂²/∂q² (r, r)."""
        matrix = self._points.stiffness(modal, project)
        if self._contact is not None:
            matrix += self._contact.stiffness(modal, project)
        return matrix

    def residual(self, modal: FloatArray, gradient: FloatArray) -> float:
        """Unbalanced force over the largest of the dead and the internal ones."""
        internal = gradient + self._dead
        scale = max(float(np.linalg.norm(self._dead)), float(np.linalg.norm(internal)))
        return float(np.linalg.norm(gradient)) / scale if scale > 0.0 else 0.0
