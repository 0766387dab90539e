"""Live answers: the reduced model from update to update, and the full one where its error bound is too large."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.model import ReducedModel

_UNKNOWN = 0.5  # share of a pull


@dataclass(frozen=True, eq=False)
class Update:
    """Node positions (n, 3) in mm, what their error is not above, the raw estimate of it, and whether they are full.

    Bound and estimate are 0 where the full model answered.
    """

    positions: FloatArray
    bound_mm: float
    raw_mm: float
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
        self._before = self._state = self._reduced.at_rest

    def update(self, load: Load) -> Update:
        """The organ under a load that is not far from the last one.

        Raises:
            StageFailed: the full model had to answer and found no equilibrium.
        """
        reduced = self._reduced
        for start in (self._state.beyond(self._before), self._state):
            answer = reduced.solve(load, start)
            if answer.converged:
                break
        known = answer.converged and self._is_known(load)
        raw = reduced.raw_error_mm(load, answer) if known else float("inf")
        bound = reduced.estimate.bound_mm(raw)
        self._before = self._state
        if bound <= self._largest_mm:
            self._state = answer.state
            return Update(reduced.positions(answer), bound, raw, False)
        positions = self._full.solve(load, reduced.positions(answer))
        self._before = self._state = reduced.state(positions)
        return Update(positions, 0.0, 0.0, True)

    def _is_known(self, load: Load) -> bool:
        """Whether most of a grasper's pull is where the local compliance is known; elsewhere no estimate sees it."""
        reached = np.isin(load.nodes, self._reduced.local.nodes)
        pulls = np.linalg.norm(load.forces, axis=1)
        return bool(pulls[~reached].sum() <= _UNKNOWN * pulls.sum())
