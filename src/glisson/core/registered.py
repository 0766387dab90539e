"""The answer of a registration: where the organ is now, and how sure that is."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray, frozen_floats
from glisson.core.deformation import Deformation
from glisson.core.errors import BadInput
from glisson.core.status import Status


@dataclass(frozen=True, eq=False)
class Registered:
    """A model fitted to observations.

    Args:
        deformation: one stage; nodes plus displacement are in the frame of the observations.
        frame: of the observations.
        spread_mm: (n, 3, k); the covariance of nodes a and b is spread_mm[a] @ spread_mm[b].T.
        unobserved: motions that nothing holds, in words; then the status is "unobservable".
        set_aside: share of the observed points that were taken for outliers.
        notes: sentences that a person should read.
        forces_mn: (n, 3) on the nodes, where the technique estimates them.
    """

    deformation: Deformation
    frame: str
    spread_mm: FloatArray
    unobserved: tuple[str, ...] = ()
    set_aside: float = 0.0
    notes: tuple[str, ...] = ()
    forces_mn: FloatArray | None = None

    def __post_init__(self) -> None:
        count = len(self.deformation.mesh.nodes)
        object.__setattr__(self, "spread_mm", frozen_floats(self.spread_mm, (count, 3, None), "spread"))
        if self.forces_mn is not None:
            object.__setattr__(self, "forces_mn", frozen_floats(self.forces_mn, (count, 3), "forces"))
        if self.unobserved and self.status.is_good:
            raise BadInput("A registration with unobserved motions cannot have converged.")

    @property
    def status(self) -> Status:
        """How it ended."""
        return self.deformation.status

    @property
    def positions_mm(self) -> FloatArray:
        """Nodes (n, 3) now, in the frame of the observations."""
        return self.deformation.mesh.moved(self.deformation.displacement)

    def covariance(self, nodes: IntArray, weights: FloatArray) -> FloatArray:
        """Covariance (m, 3, 3) in mm² of material points that are weighted (m, a) means of nodes (m, a)."""
        spread = np.einsum("ma,maik->mik", weights, self.spread_mm[nodes])
        covariance: FloatArray = spread @ spread.transpose(0, 2, 1)
        return covariance
