"""Live answers: the reduced model from update to update, and the full one where it may be too far off.

What a full answer has shown to be wrong stays known: the reduced answers after it are moved by as much, and are as
uncertain as they differ from the one that it was next to.
"""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.model import Answer, ReducedModel, State, largest

_UNKNOWN = 0.5  # share of a pull
_JUMP_MM = 3.0  # by which the organ is not where it was going
_DEEP_MM = 1.0  # at which a tool has gone through the surface
_GROWING = 2.0  # how much faster errors grow than the load
_NEAR_MM = 2.0  # within which a reduced answer is that of a full one


@dataclass(frozen=True, eq=False)
class Update:
    """Node positions (n, 3) in mm, what their error is not above, the raw estimate of it, and whether they are full.

    Bound and estimate are 0 where the full model answered.
    """

    positions: FloatArray
    bound_mm: float
    raw_mm: float
    fell_back: bool


@dataclass(frozen=True, eq=False)
class _Shown:
    """A reduced answer, and how far (n, 3) the full one next to it is."""

    answer: Answer
    apart: FloatArray

    def uncertain(self, answer: Answer) -> float:
        """What share of another answer's error is not known."""
        before = self.answer
        modal = _change(answer.state.modal, before.state.modal)
        return min(1.0, _GROWING * max(modal, _change(answer.pulled + answer.pushed, before.pulled + before.pushed)))


class LiveModel:
    """Follows an organ whose load changes.

    Args:
        reduced: the quick model.
        full: the one that it was made from.
        largest_mm: the raw estimate of the error above which the full model answers.
    """

    def __init__(self, reduced: ReducedModel, full: FullModel, largest_mm: float) -> None:
        self._reduced, self._full, self._largest_mm = reduced, full, largest_mm
        self.reset()

    def reset(self) -> None:
        """Go back to rest."""
        self._before = self._state = self._reduced.at_rest
        self._shown: _Shown | None = None

    def update(self, load: Load) -> Update:
        """The organ under a load that is not far from the last one.

        Raises:
            StageFailed: the full model had to answer and found no equilibrium.
        """
        reduced, shown = self._reduced, self._shown
        expected = self._state.beyond(self._before)
        answer = self._answer(load, expected)
        jumped = self._apart_mm(answer.state, expected) > _JUMP_MM
        if jumped:  # a tool was looked for where the organ no longer is
            answer = reduced.solve(load, answer.state)
        positions = reduced.positions(answer)
        raw = float("inf")
        if not jumped and answer.converged and self._is_known(load) and not self._is_pierced(answer):
            raw = reduced.raw_error_mm(load, answer)
            if shown is not None:
                positions, raw = positions + shown.apart, raw * shown.uncertain(answer)
        if raw <= self._largest_mm:
            self._before, self._state = self._state, answer.state
            return Update(positions, reduced.estimate.bound_mm(raw), raw, False)
        positions = self._full.solve(load, positions)
        self._go_on(load, positions, answer, jumped)
        return Update(positions, 0.0, 0.0, True)

    def _answer(self, load: Load, expected: State) -> Answer:
        for start in (expected, self._state):
            answer = self._reduced.solve(load, start)
            if answer.converged:
                break
        return answer

    def _go_on(self, load: Load, positions: FloatArray, answer: Answer, jumped: bool) -> None:
        """From full positions (n, 3), next to which the answer may be; else one is looked for there."""
        reduced = self._reduced
        apart = positions - reduced.positions(answer)
        self._before = self._state
        if jumped or largest(apart) > _NEAR_MM:
            answer = reduced.solve(load, reduced.state(positions))
            apart = positions - reduced.positions(answer)
            self._before = answer.state  # a jump does not go on
        self._state = answer.state
        self._shown = _Shown(answer, apart) if largest(apart) <= _NEAR_MM else None

    def _is_known(self, load: Load) -> bool:
        """Whether most of a grasper's pull is where the local compliance is known; elsewhere no estimate sees it."""
        reached = np.isin(load.nodes, self._reduced.local.nodes)
        pulls = np.linalg.norm(load.forces, axis=1)
        return bool(pulls[~reached].sum() <= _UNKNOWN * pulls.sum())

    def _is_pierced(self, answer: Answer) -> bool:
        """Whether a tool has gone through the surface instead of pushing it."""
        return answer.contact is not None and answer.contact.depth_mm(answer.unknowns) > _DEEP_MM

    def _apart_mm(self, state: State, expected: State) -> float:
        """How far the organ is from where it was going."""
        modes = self._reduced.estimate.sentinels[:, :, : self._reduced.size]
        return largest(modes @ (state.modal - expected.modal))


def _change(now: FloatArray, before: FloatArray) -> float:
    """By what share of itself something differs from what it was."""
    size = float(np.linalg.norm(now))
    return float(np.linalg.norm(now - before)) / size if size > 0.0 else 0.0
