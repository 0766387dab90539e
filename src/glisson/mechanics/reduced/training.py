"""Full solutions that a reduced model is made from."""

from collections.abc import Sequence

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.protocols import Progress, silent
from glisson.mechanics.reduced.full import FullModel
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.reduced.model import Answer, ReducedModel

_STEPS = 4  # in which a reduced model takes a load on


def from_rest(full: FullModel, loads: Sequence[Load], progress: Progress = silent) -> FloatArray:
    """Displacements (s, n, 3) in mm on the ways from rest to the loads; loads without an equilibrium are left out."""
    found: list[FloatArray] = []
    for number, load in enumerate(loads):
        progress(number / len(loads), f"load {number + 1} of {len(loads)}")
        try:
            found += full.path(load)
        except StageFailed:
            continue
    return np.array(found) - full.rest


def from_reduced(
    full: FullModel, reduced: ReducedModel, loads: Sequence[Load], progress: Progress = silent
) -> tuple[list[int], FloatArray]:
    """Which loads (their numbers) have an equilibrium near a reduced model's answer, and displacements (s, n, 3).

    A few full Newton steps from there take a fraction of the time of a way from rest.
    """
    numbers, found = [], []
    for number, load in enumerate(loads):
        progress(number / len(loads), f"load {number + 1} of {len(loads)}")
        try:
            found.append(full.solve(load, reduced.positions(taken_on(reduced, load))) - full.rest)
            numbers.append(number)
        except StageFailed:
            continue
    return numbers, np.array(found).reshape(-1, *full.rest.shape)


def taken_on(reduced: ReducedModel, load: Load, steps: int = _STEPS) -> Answer:
    """The reduced answer after a load came on from rest."""
    state = reduced.at_rest
    for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
        answer = reduced.solve(load.part(float(share)), state)
        state = answer.state
    return answer
