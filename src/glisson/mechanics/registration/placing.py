"""The organ as one piece, placed on what was seen without any guess."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.observations import Observations
from glisson.mechanics.registration.fitting import fit
from glisson.mechanics.registration.global_start import rigid_starts
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.seen import ModelError, Seen

RIGID_ERROR = ModelError(3.0, 25.0)
"""How far an organ is off that cannot deform."""

_REFINED = 4
_AS_GOOD = 1.05
_APART_MM = 10.0


@dataclass(frozen=True, eq=False)
class Placed:
    """Nodes (n, 3) at the best place, and a sentence where another one, some way off, is nearly as good."""

    positions: FloatArray
    ambiguous: str | None


def placed(places: Places, observations: Observations) -> Placed:
    """The rigid motion of least cost of several starts.

    Raises:
        StageFailed: none comes to rest.
    """
    motion, seen = BasisMotion(places.nodes), Seen(places, observations, RIGID_ERROR)
    fits: list[tuple[float, FloatArray]] = []
    for start in rigid_starts(places, observations)[:_REFINED]:
        try:
            shift = start.rotation @ motion.middle_mm + start.translation_mm - motion.middle_mm
            found = fit(motion, seen, MotionState(start.rotation, shift, np.zeros(0)))
            fits.append((found.cost, motion.positions(found.state)))
        except StageFailed as failure:
            last = failure
    if not fits:
        raise last
    fits.sort(key=lambda found: found[0])
    least, best = fits[0]
    for cost, other in fits[1:]:
        apart = float(np.linalg.norm(other - best, axis=1).mean())
        if cost < _AS_GOOD * least and apart > _APART_MM:
            return Placed(best, f"Another place of the organ, {apart:.0f} mm off, explains what was seen as well.")
    return Placed(best, None)
