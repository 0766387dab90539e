"""What all techniques share that move the organ by least squares: looked for everywhere, then moved from there."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.core.status import Status
from glisson.mechanics.registration.checks import check_last, check_observations
from glisson.mechanics.registration.contradictions import contradiction, misfits
from glisson.mechanics.registration.fitting import fit
from glisson.mechanics.registration.motion import BasisMotion
from glisson.mechanics.registration.outcome import outcome
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.placing import placed
from glisson.mechanics.registration.posterior import INFLATION, model_error_spread, posterior_spread
from glisson.mechanics.registration.rows import Rows
from glisson.mechanics.registration.seen import ModelError, Seen

_NEAR_MM = 5.0
"""Root mean square motion since the last answer within which that was a start to go on from."""


@dataclass(frozen=True, eq=False)
class Deformed:
    """A body at rest on what was seen.

    Args:
        positions: nodes (n, 3) now.
        spread_mm: their posterior spread (n, 3, k).
        rows: what was seen, there.
        shifts_mm: (q, 3) of the curves that were drawn.
        beliefs: (p,) how far each observed point is believed.
    """

    positions: FloatArray
    spread_mm: FloatArray
    rows: Rows
    shifts_mm: FloatArray
    beliefs: FloatArray


class Deformable(Protocol):
    """A body that can be fitted to what was seen."""

    def fitted(self, seen: Seen, start: FloatArray) -> Deformed:
        """The body at the least cost near to node positions (n, 3)."""


class Prepared:
    """A body, ready to be registered; see `PreparedRegistration`."""

    def __init__(self, model: Model, error: ModelError, body: Deformable) -> None:
        self._model, self._error, self._body = model, error, body
        self._places = Places(model)
        self._misfit_mm = model_error_spread(model.mesh, error)

    def register(
        self, observations: Observations, last: Registered | None = None, progress: Progress = silent
    ) -> Registered:
        """See `PreparedRegistration`."""
        check_observations(self._model, observations)
        if last is not None:
            check_last(self._model, observations, last)
        seen = Seen(self._places, observations, self._error)
        # What was as well elsewhere is not settled by going on from it.
        settled = last is not None and last.status is not Status.AMBIGUOUS
        near = self._near(seen, last.positions_mm, progress) if last is not None and settled else None
        found, ambiguous = self._anywhere(seen, observations, progress) if near is None else (near, None)
        off = misfits(seen, found.rows, found.shifts_mm)
        doubt = contradiction(observations, off, self._fits) or ambiguous
        spread = INFLATION * np.concatenate([found.spread_mm, self._misfit_mm], axis=2)
        return outcome(self._model, observations.frame, found.positions, spread, found.beliefs, doubt)

    def _near(self, seen: Seen, last: FloatArray, progress: Progress) -> Deformed | None:
        """The body next to nodes (n, 3) where it was; None where it is not there any more.

        From far away the way to what is nearest ends anywhere, so that it says nothing of where the organ is.
        """
        progress(0.4, "deforming the organ")
        try:
            found = self._body.fitted(seen, last)
        except StageFailed:
            return None
        moved = np.sqrt(((found.positions - last) ** 2).sum(axis=1).mean())
        return found if moved < _NEAR_MM else None

    def _anywhere(self, seen: Seen, observations: Observations, progress: Progress) -> tuple[Deformed, str | None]:
        """The body wherever it is, and a sentence where it may as well be elsewhere."""
        progress(0.0, "placing the organ")
        place = placed(self._places, observations)
        progress(0.4, "deforming the organ")
        return self._body.fitted(seen, place.positions), place.ambiguous

    def _fits(self, observations: Observations) -> bool:
        seen = Seen(self._places, observations, self._error)
        found, _ = self._anywhere(seen, observations, silent)
        return not misfits(seen, found.rows, found.shifts_mm)


class MovedBody:
    """A body that moves by a basis.

    Args:
        motion: its ways to move.
        usual: see `posterior_spread`.
    """

    def __init__(self, motion: BasisMotion, usual: float = 1.0) -> None:
        self._motion, self._usual = motion, usual

    def fitted(self, seen: Seen, start: FloatArray) -> Deformed:
        """See `Deformable`."""
        motion = self._motion
        found = fit(motion, seen, motion.nearest(start))
        spread = posterior_spread(motion, found, self._usual)
        return Deformed(motion.positions(found.state), spread, found.rows, found.shifts_mm, found.beliefs)
