"""A deforming motion, fitted from where the organ lies as one piece."""

import numpy as np

from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.protocols import Progress
from glisson.core.registered import Registered
from glisson.mechanics.registration.fitting import fit
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.outcome import outcome, posterior_spread
from glisson.mechanics.registration.placing import RIGID_ERROR, placed
from glisson.mechanics.registration.seen import ModelError, Seen


def elastic_fit(
    model: Model, observations: Observations, motion: BasisMotion, error: ModelError, progress: Progress
) -> Registered:
    """Place the organ as one piece, then let it deform."""
    progress(0.4, "placing the organ")
    place = placed(model, observations, Seen(model, observations, RIGID_ERROR), BasisMotion(model.mesh.nodes))
    progress(0.7, "deforming the organ")
    start = MotionState(place.fit.state.rotation, place.fit.state.shift_mm, np.zeros(motion.size - 6))
    found = fit(motion, Seen(model, observations, error), start)
    positions, spread = motion.positions(found.state), posterior_spread(motion, found)
    return outcome(model, observations.frame, positions, spread, found.beliefs, place.ambiguous)
