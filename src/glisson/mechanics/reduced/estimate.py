"""How far the reduced answer is from the full one: its residual in more modes, turned into displacements.

The modes that were left out, and more points than the solution used, see forces that the solution doesn't balance; the
organ's stiffness and the tool's turn them into a displacement. A factor, found on loads of their own
(`calibrated`), makes an upper bound of the largest displacement of it.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.contact import ReducedContact, ReducedSurface
from glisson.mechanics.reduced.points import ElasticPoints
from glisson.mechanics.reduced.potential import with_contact

_MARGIN = 1.25  # on the largest ratio that calibration saw
_FLOOR_MM = 0.005  # errors below are not told apart


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
    ) -> tuple[float, float]:
        """The largest displacements that the residual makes, and a tool whose pushes move the surface otherwise.

        The second counts as if the surface gave way twice as much as the local compliance has it. Both are infinite
        where the organ is about to give way.

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
        gradient = self.points.forces(self.points.gradients(unknowns[:size])) - weight
        matrix = with_tangent(self.stiffness, tangent)
        if contact is not None:
            extended = np.concatenate([modal, unknowns[size:]])
            contact = contact.in_modes(surface, extended)
            pull = pull + contact.forces(extended)[:size]
            matrix = with_contact(matrix, contact, extended, project=False)
        right = np.zeros((len(matrix), 2))
        right[: len(modal), 0] = gradient - self._answered(pull)
        if contact is not None:
            right[len(modal) :, 1] = contact.compliance @ unknowns[size:]
        try:
            steps = cho_solve(cho_factor(matrix, check_finite=False), right, check_finite=False)
        except np.linalg.LinAlgError:
            return float("inf"), float("inf")
        moved = np.linalg.norm(self.sentinels @ steps[: len(modal)], axis=1).max(axis=0)
        return float(moved[0]), float(moved[1])

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
