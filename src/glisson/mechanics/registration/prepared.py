"""What all techniques share that move the organ by least squares: looked for everywhere, then moved from there."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.mechanics.registration.checks import check_last, check_observations
from glisson.mechanics.registration.contradictions import contradiction, misfits
from glisson.mechanics.registration.fitting import fit
from glisson.mechanics.registration.motion import BasisMotion
from glisson.mechanics.registration.outcome import outcome
from glisson.mechanics.registration.places import Places
from glisson.mechanics.registration.placing import placed
from glisson.mechanics.registration.posterior import INFLATION, model_error_spread, posterior_spread
from glisson.mechanics.registration.seen import ModelError, Seen


@dataclass(frozen=True, eq=False)
class Deformed:
    """Nodes (n, 3) now, their posterior spread (n, 3, k), and how far each observed point is believed (p,)."""

    positions: FloatArray
    spread_mm: FloatArray
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
        ambiguous = None
        if last is None:
            progress(0.0, "placing the organ")
            place = placed(self._places, observations)
            start, ambiguous = place.positions, place.ambiguous
        else:
            check_last(self._model, observations, last)
            start = last.positions_mm
        progress(0.4, "deforming the organ")
        found, off = self._fitted(observations, start)
        doubt = contradiction(observations, off, self._fits) or ambiguous
        spread = INFLATION * np.concatenate([found.spread_mm, self._misfit_mm], axis=2)
        return outcome(self._model, observations.frame, found.positions, spread, found.beliefs, doubt)

    def _fitted(self, observations: Observations, start: FloatArray) -> tuple[Deformed, tuple[str, ...]]:
        """The body fitted, and what does not fit."""
        seen = Seen(self._places, observations, self._error)
        found = self._body.fitted(seen, start)
        return found, misfits(seen, seen.rows(found.positions))

    def _fits(self, observations: Observations) -> bool:
        _, off = self._fitted(observations, placed(self._places, observations).positions)
        return not off


class MovedBody:
    """A body that moves by a basis."""

    def __init__(self, motion: BasisMotion) -> None:
        self._motion = motion

    def fitted(self, seen: Seen, start: FloatArray) -> Deformed:
        """See `Deformable`."""
        motion = self._motion
        found = fit(motion, seen, motion.nearest(start))
        return Deformed(motion.positions(found.state), posterior_spread(motion, found), found.beliefs)
