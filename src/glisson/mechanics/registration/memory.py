"""What was seen lately: the newest observation of each thing, the less sure the longer ago it was."""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.observations import Observation, Observations

_FORGOTTEN_MM = 20.0
"""An observation that is less sure than this is of no more use."""


@dataclass(frozen=True, eq=False)
class Memory:
    """What was seen so far.

    Args:
        drift_mm_per_s: how fast the organ moves away from where a thing was seen.
        items: of each thing, by kind and name, those of the newest frame that has it.
        notes: sentences on what came too late to be of use.
    """

    drift_mm_per_s: float
    items: tuple[Observation, ...] = ()
    notes: tuple[str, ...] = ()

    def with_frame(self, frame: Observations) -> "Memory":
        """What is remembered once a frame, of whatever time, has been seen too."""
        known = {(item.kind, item.name): item.time_s for item in self.items}
        fresh, notes = [], []
        for item in (item for item in frame.items if len(item.points_mm)):
            before = known.get((item.kind, item.name), -np.inf)
            if item.time_s >= before:
                fresh.append(item)
            else:
                notes.append(f"{item.name!r} of {item.time_s:g} s came after that of {before:g} s and was not used.")
        seen = {(item.kind, item.name) for item in fresh}
        kept = [item for item in self.items if (item.kind, item.name) not in seen]
        return Memory(self.drift_mm_per_s, (*kept, *fresh), tuple(notes))

    def at(self, now_s: float) -> tuple[Observation, ...]:
        """What counts at a time."""
        aged = (_aged(item, self.drift_mm_per_s * max(now_s - item.time_s, 0.0)) for item in self.items)
        return tuple(item for item in aged if item.sigma_mm < _FORGOTTEN_MM)


def _aged(item: Observation, moved_mm: float) -> Observation:
    """An observation of which the organ may have moved away by so much (one standard deviation, along each axis)."""
    covariance = item.covariance_mm2
    if covariance is not None:
        covariance = covariance + moved_mm**2 * np.eye(3)
    return replace(item, sigma_mm=float(np.hypot(item.sigma_mm, moved_mm)), covariance_mm2=covariance)
