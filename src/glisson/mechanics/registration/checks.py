"""What is wrong with observations can be told before anything is fitted."""

import numpy as np

from glisson.core.errors import BadInput
from glisson.core.model import Model
from glisson.core.observations import Observations
from glisson.core.registered import Registered

_METRES = 0.02
_MUCH_LARGER = 3.0
_FAR = 1.0
_FEWEST = 3


def check_observations(model: Model, observations: Observations) -> None:
    """Refuse observations that cannot be of this model.

    Raises:
        BadInput: there are none, they are in other units, or far away in the model's own frame.
    """
    if not observations.items or sum(len(item.points_mm) for item in observations.items) == 0:
        raise BadInput("There are no observations; give surface points, landmarks, curves or contacts.")
    points = np.concatenate([item.points_mm for item in observations.items])
    distinct = len(np.unique(points.round(6), axis=0))
    if distinct < _FEWEST:
        raise BadInput(f"{distinct} different observed points do not place an organ; give {_FEWEST} or more.")
    nodes = model.mesh.nodes
    organ = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    seen = float(np.linalg.norm(np.ptp(points, axis=0)))
    if seen < _METRES * organ and seen > 0.0:
        raise BadInput(
            f"The observations span {seen:.3g} mm and the organ {organ:.0f} mm; these look like metres; give mm."
        )
    if seen > _MUCH_LARGER * organ:
        raise BadInput(f"The observations span {seen:.0f} mm, but the organ only {organ:.0f} mm; check the units.")
    apart = float(np.linalg.norm(points.mean(axis=0) - nodes.mean(axis=0)))
    if observations.frame == "patient" and apart > _FAR * organ:
        raise BadInput(
            f'The observations lie {apart:.0f} mm from the organ in the frame "patient"; name the frame they are in.'
        )


def check_last(model: Model, observations: Observations, last: Registered) -> None:
    """Refuse a last answer that nothing can begin from.

    Raises:
        BadInput: it is of another model, or in another frame than the observations.
    """
    if not np.array_equal(last.deformation.mesh.nodes, model.mesh.nodes):
        raise BadInput("The last answer is of another model; begin without it.")
    if last.frame != observations.frame:
        raise BadInput(
            f"The last answer is in the frame {last.frame!r} and the observations in {observations.frame!r}."
        )
