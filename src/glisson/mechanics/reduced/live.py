"""Live answers: the reduced model from update to update, and the full one where its error bound is too large."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.model import ReducedModel


@dataclass(frozen=True, eq=False)
class Update:
    """Node positions (n, 3) in mm, what their error is not above (0 for the full model's own), and whose they are."""

    positions: FloatArray
    bound_mm: float
    fell_back: bool


class LiveModel:
    """Follows an organ whose load changes.

    Args:
        reduced: the quick model.
        full: the one that it was made from.
        largest_mm: the error bound above which the full model answers.
    """

    def __init__(self, reduced: ReducedModel, full: FullModel, largest_mm: float) -> None:
        self._reduced, self._full, self._largest_mm = reduced, full, largest_mm
        self.reset()

    def reset(self) -> None:
        """Go back to rest."""
        self._modal = np.zeros(self._reduced.size)

    def update(self, load: Load) -> Update:
        """The organ under a load that is not far from the last one.

        Raises:
            StageFailed: the full model had to answer and found no equilibrium.
        """
        reduced = self._reduced
        found = reduced.solve(load, self._modal)
        positions = reduced.positions(found.unknowns)
        bound = reduced.bound_mm(load, found.unknowns) if found.converged else float("inf")
        if bound <= self._largest_mm:
            self._modal = found.unknowns
            return Update(positions, bound, False)
        start = positions if found.converged else reduced.positions(self._modal)
        positions = self._full.solve(load, start)
        self._modal = reduced.modal(positions)
        return Update(positions, 0.0, True)
