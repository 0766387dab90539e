"""A fit as the answer that callers get."""

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.model import Model
from glisson.core.registered import Registered
from glisson.core.status import Status
from glisson.mechanics.registration.observability import unheld_motions

STAGE = "registration"
_SET_ASIDE = 0.25


def outcome(
    model: Model,
    frame: str,
    positions: FloatArray,
    spread_mm: FloatArray,
    beliefs: FloatArray,
    ambiguous: str | None,
    forces_mn: FloatArray | None = None,
) -> Registered:
    """The answer of a fit that came to rest.

    Args:
        model: in its scanned shape.
        frame: of the observations.
        positions: nodes (n, 3) now.
        spread_mm: (n, 3, k), see `Registered`.
        beliefs: (p,) how far each observed point is believed, 0 to 1.
        ambiguous: a sentence on another answer that is as good.
        forces_mn: (n, 3), where they were looked for.
    """
    unobserved = unheld_motions(positions, spread_mm)
    status, message = Status.CONVERGED, Status.CONVERGED.sentence
    if unobserved:
        status, message = Status.UNOBSERVABLE, f"The observations do not determine the answer: {'; '.join(unobserved)}."
    elif ambiguous is not None:
        status, message = Status.AMBIGUOUS, ambiguous
    stage = StageResult(STAGE, positions - model.mesh.nodes, status)
    return Registered(
        deformation=Deformation(model.mesh, (stage,), status, message),
        frame=frame,
        spread_mm=spread_mm,
        unobserved=unobserved,
        set_aside=float((beliefs < _SET_ASIDE).mean()),
        forces_mn=forces_mn,
    )
