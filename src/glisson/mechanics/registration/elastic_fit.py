"""A deforming motion, fitted from where the organ lies as one piece."""

import numpy as np

from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.protocols import Progress
from glisson.core.registered import Registered
from glisson.mechanics.registration.fitting import fit
from glisson.mechanics.registration.motion import BasisMotion, MotionState
from glisson.mechanics.registration.outcome import outcome
from glisson.mechanics.registration.placing import placed
from glisson.mechanics.registration.seen import ModelError, Seen

_RIGID = ModelError(4.0, 40.0)


def elastic_fit(
    model: Model, observations: Observations, motion: BasisMotion, error: ModelError, progress: Progress
) -> Registered:
    """Place the organ as one piece, then let it deform."""
    progress(0.4, "placing the organ")
    place = placed(model, observations, Seen(model, observations, _RIGID), BasisMotion(model.mesh.nodes))
    progress(0.7, "deforming the organ")
    start = MotionState(place.fit.state.rotation, place.fit.state.shift_mm, np.zeros(motion.size - 6))
    found = fit(motion, Seen(model, observations, error), start)
    return outcome(model, observations.frame, motion, found, motion.radius_mm, place.ambiguous)
