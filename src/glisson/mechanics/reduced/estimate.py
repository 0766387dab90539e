"""How far the reduced answer is from the full one: its residual in more modes, turned into displacements.

The modes that were left out, and more points than the solution used, see forces that the solution doesn't balance; the
organ's stiffness and the tool's turn them into a displacement. A factor, found on loads of their own
(`calibrated`), makes an upper bound of the largest displacement of it.
"""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.contact import ReducedContact, ReducedSurface
from glisson.mechanics.reduced.points import ElasticPoints
from glisson.mechanics.reduced.potential import with_contact

_MARGIN = 1.5  # on the largest ratio that calibration saw
_FLOOR_MM = 0.01  # errors below are not told apart


@dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """The estimate in R ≥ r modes, the first r of which are the solution's.

    Args:
        points: those of the residual, strained by all R modes.
        stiffness: (R, R) at rest.
        sentinels: (k, 3, R) modes at the nodes at which the largest displacement is looked for.
        factor: of the raw estimate in the bound.
    """

    points: ElasticPoints
    stiffness: FloatArray
    sentinels: FloatArray
    factor: float = 1.0

    def modal_mm(
        self,
        unknowns: FloatArray,
        tangent: FloatArray,
        weight: FloatArray,
        pull: FloatArray,
        contact: ReducedContact | None,
        surface: ReducedSurface,
    ) -> float:
        """The largest displacement that the residual makes.

        Args:
            unknowns: (r + c,) the solution.
            tangent: (r, r) its elastic stiffness.
            weight: (R,) the weight on all modes.
            pull: (r,) forces of graspers on the solution's modes.
            contact: with the tool, if there is one, in the solution's modes.
            surface: in all R modes.
        """
        size, modal = len(pull), np.zeros(len(self.stiffness))
        modal[:size] = unknowns[:size]
        gradient = self.points.forces(self.points.gradients(modal)) - weight
        matrix = with_tangent(self.stiffness, tangent)
        right = gradient
        if contact is not None:
            contact = contact.in_modes(surface)
            extended = np.concatenate([modal, unknowns[size:]])
            pull = pull + contact.forces(extended)[:size]
            matrix = with_contact(matrix, contact, extended, project=True)
            right = np.zeros(len(matrix))
        right[: len(modal)] = gradient - self._answered(pull)
        step = np.linalg.solve(matrix, right)
        return float(np.linalg.norm(self.sentinels @ step[: len(modal)], axis=1).max())

    def _answered(self, forces: FloatArray) -> FloatArray:
        """What forces (r,) on surface nodes are on all modes (R,), as the local compliance takes the rest of them."""
        size = len(forces)
        answer = np.linalg.solve(self.stiffness[:size, :size], forces)
        result: FloatArray = self.stiffness[:, :size] @ answer
        return result

    def bound_mm(self, raw_mm: float) -> float:
        """What the error is not above, by all that calibration saw."""
        return self.factor * (raw_mm + _FLOOR_MM)

    def calibrated(self, raw_mm: FloatArray, true_mm: FloatArray) -> "ErrorEstimate":
        """With the factor from raw estimates and true errors of loads that serve nothing else."""
        return replace(self, factor=_MARGIN * float((true_mm / (raw_mm + _FLOOR_MM)).max()))


def with_tangent(stiffness: FloatArray, tangent: FloatArray) -> FloatArray:
    """The stiffness at rest (R, R) with the present one (r, r) of the first modes."""
    result = stiffness.copy()
    result[: len(tangent), : len(tangent)] = tangent
    return result
