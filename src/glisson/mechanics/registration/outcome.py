"""A fit as the answer that callers get."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.model import Model
from glisson.core.registered import Registered
from glisson.core.status import Status
from glisson.mechanics.registration.fitting import Fit
from glisson.mechanics.registration.motion import Motion, MotionState
from glisson.mechanics.registration.observability import unheld_motions

STAGE = "registration"
_SET_ASIDE = 0.25


def outcome(
    model: Model, frame: str, motion: Motion, found: Fit, radius_mm: float, ambiguous: str | None = None
) -> Registered:
    """Displacement, posterior and status of a fit; `ambiguous` is a sentence on another answer that is as good."""
    positions = motion.positions(found.state)
    unobserved = unheld_motions(found, positions.mean(axis=0), radius_mm)
    status, message = Status.CONVERGED, Status.CONVERGED.sentence
    if unobserved:
        status, message = Status.UNOBSERVABLE, f"The observations do not determine the answer: {'; '.join(unobserved)}."
    elif ambiguous is not None:
        status, message = Status.AMBIGUOUS, ambiguous
    stage = StageResult(STAGE, positions - model.mesh.nodes, status)
    return Registered(
        deformation=Deformation(model.mesh, (stage,), status, message),
        frame=frame,
        spread_mm=posterior_spread(motion, found),
        unobserved=unobserved,
        set_aside=float((found.weights < _SET_ASIDE).mean()),
    )


def posterior_spread(motion: Motion, found: Fit) -> FloatArray:
    """Derivative of all nodes by independent unknowns of unit variance (n, 3, size), from the Gauss–Newton Hessian.

    Directions that nothing determines are given a large finite spread.
    """
    values, vectors = np.linalg.eigh(found.data + found.prior)
    root = vectors / np.sqrt(np.maximum(values, _LEAST_PRECISION))
    nodes = np.arange(len(motion.positions(found.state)))
    spread: FloatArray = motion.derivative(found.state, nodes) @ root
    return spread


_LEAST_PRECISION = 1e-6  # per mm²: a standard deviation of a metre


def rest_state(rotation: FloatArray, translation_mm: FloatArray, middle_mm: FloatArray, amounts: int) -> MotionState:
    """The state of x = R X + t without any deformation."""
    return MotionState(rotation, rotation @ middle_mm + translation_mm - middle_mm, np.zeros(amounts))
