"""How far the reduced answer is from the full one: its residual in more modes, turned into displacements.

The modes that were left out, and more points than the solution used, see forces that the solution doesn't balance; the
organ's stiffness at rest and the tool's present one turn them into a displacement. A factor and a floor, found on loads
of their own (`calibrated`), make an upper bound of the largest displacement.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from glisson.core.arrays import FloatArray
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.reduced.contact import ReducedContact, ReducedSurface
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.points import ElasticPoints

_MARGIN = 1.5  # on the largest ratio that calibration saw
_FLOOR_MM = 0.02  # errors below are not told apart


@dataclass(frozen=True, eq=False)
class ErrorEstimate:
    """The estimate in R ≥ r modes, the first r of which are the solution's.

    Args:
        points: those of the residual, strained by all R modes.
        surface: in all R modes.
        stiffness: (R, R) at rest.
        sentinels: (k, 3, R) modes at the nodes at which the largest displacement is looked for.
        factor: of the raw estimate in the bound.
    """

    points: ElasticPoints
    surface: ReducedSurface
    stiffness: FloatArray
    sentinels: FloatArray
    factor: float = 1.0

    def raw_mm(self, modal: FloatArray, dead: FloatArray, load: Load, cushion: Cushion) -> float:
        """The largest displacement that the residual at modal displacements (r,) makes; `dead` (R,) forces."""
        extended = np.zeros(len(self.stiffness))
        extended[: len(modal)] = modal
        gradient = self.points.forces(extended) - dead
        matrix = self.stiffness
        if load.tool is not None:
            contact = ReducedContact(self.surface, load, cushion, extended)
            gradient -= contact.forces(extended)
            matrix = matrix + contact.stiffness(extended, project=True)
        step = cho_solve(cho_factor(matrix, check_finite=False), gradient, check_finite=False)
        return float(np.linalg.norm(self.sentinels @ step, axis=1).max())

    def bound_mm(self, raw_mm: float) -> float:
        """What the error is not above, by all that calibration saw."""
        return self.factor * (raw_mm + _FLOOR_MM)

    def calibrated(self, raw_mm: FloatArray, true_mm: FloatArray) -> "ErrorEstimate":
        """With the factor from raw estimates and true errors of loads that serve nothing else."""
        return replace(self, factor=_MARGIN * float((true_mm / (raw_mm + _FLOOR_MM)).max()))
