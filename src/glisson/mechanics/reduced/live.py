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
_UNEXPECTED = 0.15  # share of what it is not, in the estimate: where the organ gives way, small errors grow
_GROWN = 2.0  # as many times an error is believed to have grown, at most
_LEFT = 0.15  # share of an error that no full answer takes away from the ones after it
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
    """A reduced answer with its raw estimate, and how far (n, 3) the full one next to it is."""

    answer: Answer
    raw_mm: float
    apart: FloatArray

    def error(self, answer: Answer, raw_mm: float) -> tuple[FloatArray, float]:
        """What another answer is wrong by (n, 3), as it grows with the estimate, and the estimate of what is left."""
        before = self.answer
        modal = _change(answer.state.modal, before.state.modal)
        local = _change(answer.pulled + answer.pushed, before.pulled + before.pushed)
        left = min(1.0, _LEFT + max(modal, local))
        return min(raw_mm / self.raw_mm, _GROWN) * self.apart, left * raw_mm


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
        unexpected = self._apart_mm(answer.state, expected)
        jumped = unexpected > _JUMP_MM
        if jumped:  # a tool was looked for where the organ no longer is
            answer = reduced.solve(load, answer.state)
        positions = reduced.positions(answer)
        raw = own = float("inf") if jumped else self._raw_mm(load, answer)
        if shown is not None and np.isfinite(own):
            wrong, raw = shown.error(answer, own)
            positions = positions + wrong
        raw += _UNEXPECTED * unexpected
        if raw <= self._largest_mm:
            self._before, self._state = self._state, answer.state
            return Update(positions, reduced.estimate.bound_mm(raw), raw, False)
        positions = self._full.solve(load, positions)
        self._go_on(load, positions, answer, own)
        return Update(positions, 0.0, 0.0, True)

    def _answer(self, load: Load, expected: State) -> Answer:
        for start in (expected, self._state):
            answer = self._reduced.solve(load, start)
            if answer.converged:
                break
        return answer

    def _go_on(self, load: Load, positions: FloatArray, answer: Answer, raw_mm: float) -> None:
        """From full positions (n, 3), next to which the answer may be; else one is looked for there."""
        reduced = self._reduced
        apart = positions - reduced.positions(answer)
        self._before = self._state
        if not np.isfinite(raw_mm) or largest(apart) > _NEAR_MM:
            answer = reduced.solve(load, reduced.state(positions))
            apart, raw_mm = positions - reduced.positions(answer), self._raw_mm(load, answer)
            self._before = answer.state  # a jump does not go on
        self._state = answer.state
        near = 0.0 < raw_mm < np.inf and largest(apart) <= _NEAR_MM
        self._shown = _Shown(answer, raw_mm, apart) if near else None

    def _raw_mm(self, load: Load, answer: Answer) -> float:
        """The estimate of an answer's own error; infinite where nothing is known of it."""
        known = answer.converged and self._is_known(load) and not self._is_pierced(answer)
        return self._reduced.raw_error_mm(load, answer) if known else float("inf")

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
