"""The organ as one piece, placed on what was seen without any guess."""

from dataclasses import dataclass

import numpy as np

from glisson.core.errors import StageFailed
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.mechanics.registration.fitting import Fit, fit
from glisson.mechanics.registration.global_start import rigid_starts
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.seen import ModelError, Seen

RIGID_ERROR = ModelError(3.0, 25.0)
"""How far an organ is off that cannot deform."""

_REFINED = 4
_AS_GOOD = 1.05
_APART_MM = 10.0


@dataclass(frozen=True, eq=False)
class Placed:
    """The best place, and a sentence where another one, some way off, is nearly as good."""

    fit: Fit
    ambiguous: str | None


def placed(model: Model, observations: Observations, seen: Seen, motion: BasisMotion) -> Placed:
    """The rigid motion of least cost of several starts.

    Raises:
        StageFailed: none comes to rest.
    """
    fits: list[Fit] = []
    for start in rigid_starts(model, observations)[:_REFINED]:
        try:
            shift = start.rotation @ motion.middle_mm + start.translation_mm - motion.middle_mm
            fits.append(fit(motion, seen, MotionState(start.rotation, shift, np.zeros(0))))
        except StageFailed as failure:
            last = failure
    if not fits:
        raise last
    fits.sort(key=lambda found: found.cost)
    best = motion.positions(fits[0].state)
    for other in fits[1:]:
        apart = float(np.linalg.norm(motion.positions(other.state) - best, axis=1).mean())
        if other.cost < _AS_GOOD * fits[0].cost and apart > _APART_MM:
            return Placed(fits[0], f"Another place of the organ, {apart:.0f} mm off, explains what was seen as well.")
    return Placed(fits[0], None)
