"""Frames one after another: each begins from the last answer, and the organ is looked for anew where it jumped."""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.errors import BadInput, StageFailed
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.protocols import PreparedRegistration, Progress, silent
from glisson.core.registered import Registered
from glisson.core.status import Status
from glisson.mechanics.registration.memory import Memory
from glisson.mechanics.registration.outcome import STAGE

_SET_ASIDE = 0.35
"""With so many outliers the organ is rather elsewhere: a registration withstands a fifth."""

_METRE = 1000.0


@dataclass(frozen=True, eq=False)
class Followed:
    """The answer of one frame.

    Args:
        found: where the organ is.
        time_s: of the frame.
        moved_mm: root mean square of the nodes' motion since the last frame; 0 in the first.
        jumped: the organ is not where it could have come in the ordinary course of things; it was looked for anew.
    """

    found: Registered
    time_s: float
    moved_mm: float
    jumped: bool


class Following:
    """Registers frames in the order in which they come.

    A frame may be empty or late: what was seen before counts on, the less the longer ago it was.

    Args:
        model: the organ.
        prepared: it, ready to be registered.
        drift_mm_per_s: how fast the organ moves about in the ordinary course of things.
        jump_mm: root mean square of a motion between two frames that is no ordinary one.
    """

    def __init__(
        self, model: Model, prepared: PreparedRegistration, drift_mm_per_s: float = 2.0, jump_mm: float = 15.0
    ) -> None:
        self._model, self._prepared, self._jump_mm = model, prepared, jump_mm
        self._fresh = Memory(drift_mm_per_s)
        self._memory = self._fresh
        self._last: Followed | None = None

    def next(self, frame: Observations, now_s: float | None = None, progress: Progress = silent) -> Followed:
        """The answer with a further frame.

        Args:
            frame: what was seen since the last one, perhaps nothing.
            now_s: the time now; without it that of the newest observation.
            progress: told how far it is.

        Raises:
            BadInput: the observations cannot be of this model.
            StageFailed: the organ is not found. After either all is as it was before the frame.
        """
        times = [item.time_s for item in frame.items] + ([] if self._last is None else [self._last.time_s])
        now = max(times, default=0.0) if now_s is None else now_s
        memory = self._memory.with_frame(frame)
        items = memory.at(now)
        if not items:
            return self._unseen(now)
        found, jumped = self._found(Observations(items), frame, progress)
        moved = 0.0 if self._last is None else _apart(found, self._last.found)
        notes = (f"The organ jumped by {moved:.0f} mm since the last frame.",) if jumped else ()
        answer = Followed(replace(found, notes=(*found.notes, *memory.notes, *notes)), now, moved, jumped)
        self._last, self._memory = answer, self._fresh.with_frame(frame) if jumped else memory
        return answer

    def _found(self, remembered: Observations, frame: Observations, progress: Progress) -> tuple[Registered, bool]:
        """The organ, and whether it jumped."""
        if self._last is None:
            return self._prepared.register(remembered, None, progress), False
        last = self._last.found
        try:
            followed = self._prepared.register(remembered, last, progress)
        except StageFailed as failure:
            anew = self._anew(frame, progress)
            if anew is None:
                raise failure
            return anew, _apart(anew, last) >= self._jump_mm
        if followed.set_aside < _SET_ASIDE and _apart(followed, last) < self._jump_mm:
            return followed, False
        anew = self._anew(frame, progress)
        if anew is None or not anew.status.is_good:
            return followed, False
        return anew, _apart(anew, last) >= self._jump_mm

    def _anew(self, frame: Observations, progress: Progress) -> Registered | None:
        """The organ looked for by what is new alone, as what was seen before a jump is of no more use.

        None where that is too little to tell.
        """
        try:
            return self._prepared.register(frame, None, progress)
        except (BadInput, StageFailed):
            return None

    def _unseen(self, now_s: float) -> Followed:
        """The last place, or that of the scan, without any certainty."""
        nodes, last = self._model.mesh.nodes, self._last
        displacement = np.zeros_like(nodes) if last is None else last.found.deformation.displacement
        message = "Nothing has been seen yet." if last is None else f"Nothing has been seen for long, at {now_s:g} s."
        stage = StageResult(STAGE, displacement, Status.UNOBSERVABLE)
        deformation = Deformation(self._model.mesh, (stage,), Status.UNOBSERVABLE, message)
        anywhere: FloatArray = np.tile(_METRE * np.eye(3), (len(nodes), 1, 1))
        frame = "patient" if last is None else last.found.frame
        found = Registered(deformation, frame, anywhere, ("nothing holds the organ",))
        return Followed(found, now_s, 0.0, False)


def _apart(one: Registered, other: Registered) -> float:
    """Root mean square distance of the nodes, mm."""
    return float(np.sqrt(((one.positions_mm - other.positions_mm) ** 2).sum(axis=1).mean()))
