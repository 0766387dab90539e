"""The potential of a load over the modes."""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.contact import ReducedContact
from glisson.mechanics.reduced.points import ElasticPoints

_FAST = 0.2  # share of a residual that a step may leave, without a new elastic stiffness being made
_WHOLE_MM = 100.0  # a displacement that counts as much as the largest force


class ReducedPotential:
    """Energy, gradient and Newton's step over the unknowns (r + c,): modal displacements, and pushes of a tool.

    Args:
        points: where the elastic energy is taken.
        dead: (r,) dead forces on the modes.
        contact: the tool, if there is one.
        tangent: (r, r) elastic stiffness of a state nearby, which serves as long as the residual falls fast.
    """

    def __init__(
        self,
        points: ElasticPoints,
        dead: FloatArray,
        contact: ReducedContact | None,
        tangent: FloatArray | None = None,
    ) -> None:
        self._points, self._dead, self._contact = points, dead, contact
        self._size = len(dead)
        self._scale = 0.0
        self._tangent, self._before = tangent, np.inf
        self._last: tuple[FloatArray, FloatArray] | None = None
        self.rounding = points.rounding_uj

    def energy(self, unknowns: FloatArray) -> float:
        """In µJ; infinite where a chosen element is inverted."""
        modal, pushes = unknowns[: self._size], unknowns[self._size :]
        energy = self._points.energy(self._gradients(unknowns)) - float(self._dead @ modal)
        if self._contact is not None and np.isfinite(energy):
            energy += self._contact.energy(unknowns) + 0.5 * float(pushes @ self._contact.compliance @ pushes)
        return energy

    def gradient(self, unknowns: FloatArray) -> FloatArray:
        """What is unbalanced: forces in mN on the modes, and displacements in mm along the pushes."""
        gradient = np.zeros_like(unknowns)
        elastic = self._points.forces(self._gradients(unknowns))
        self._scale = max(float(np.linalg.norm(elastic)), float(np.linalg.norm(self._dead)))
        gradient[: self._size] = elastic - self._dead
        if self._contact is not None:
            gradient[self._size :] = self._contact.compliance @ unknowns[self._size :]
            gradient -= self._contact.forces(unknowns)
        return gradient

    def step(self, unknowns: FloatArray, gradient: FloatArray) -> FloatArray:
        """Newton's step; the exact stiffness where it is positive definite."""
        residual = self.residual(unknowns, gradient)
        slow, self._before = residual > _FAST * self._before, residual
        if self._tangent is None or slow:
            self._tangent = self._points.stiffness(self._gradients(unknowns))
        for project in (False, True):
            try:
                return _solved(self._completed(self._tangent, unknowns, project), gradient)
            except np.linalg.LinAlgError:
                continue
        projected = self._points.stiffness(self._gradients(unknowns), project=True)
        return _solved(self._completed(projected, unknowns, True), gradient)

    def tangent(self, unknowns: FloatArray) -> FloatArray:
        """The elastic stiffness (r, r) of the last step, or here if none was needed."""
        return self._points.stiffness(self._gradients(unknowns)) if self._tangent is None else self._tangent

    def stiffness(self, unknowns: FloatArray) -> FloatArray:
        """The second derivatives."""
        return self._completed(self._points.stiffness(self._gradients(unknowns)), unknowns, False)

    def _completed(self, elastic: FloatArray, unknowns: FloatArray, project: bool) -> FloatArray:
        return elastic if self._contact is None else with_contact(elastic, self._contact, unknowns, project)

    def _gradients(self, unknowns: FloatArray) -> FloatArray:
        """Deformation gradients; those of the last unknowns are kept."""
        if self._last is None or self._last[0] is not unknowns:
            self._last = (unknowns, self._points.gradients(unknowns[: self._size]))
        return self._last[1]

    def residual(self, unknowns: FloatArray, gradient: FloatArray) -> float:
        """Unbalanced force on the modes, over the larger of the dead and the elastic ones; pushes count by mm."""
        on_modes = float(np.linalg.norm(gradient[: self._size]))
        apart = float(np.abs(gradient[self._size :]).max(initial=0.0)) / _WHOLE_MM
        return max(on_modes / self._scale if self._scale > 0.0 else 0.0, apart)


def _solved(matrix: FloatArray, gradient: FloatArray) -> FloatArray:
    factor = cho_factor(matrix, check_finite=False)
    step: FloatArray = cho_solve(factor, -gradient, check_finite=False)
    return step


def with_contact(elastic: FloatArray, contact: ReducedContact, unknowns: FloatArray, project: bool) -> FloatArray:
    """The stiffness of modes (r, r), and a tool's contact with them and with the pushes: (r + c, r + c)."""
    size = len(elastic)
    matrix = contact.stiffness(unknowns, project)
    matrix[:size, :size] += elastic
    matrix[size:, size:] += contact.compliance
    return matrix
