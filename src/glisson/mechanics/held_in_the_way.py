"""Whether a tool's way leads through a part of the organ that is held, which no equilibrium can have."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.units import place_text
from glisson.mechanics.body import Body, LoadState

_SHARES = np.linspace(0.0, 1.0, 33)[1:]  # of the way that are looked at
_HAIR_MM = 0.05  # a mesh strays from the organ by more than that


def held_in_the_way(body: Body, positions: FloatArray, goal: LoadState) -> str | None:
    """Which tool would cut into a held part on its way to the goal, and where, in words; None where none does.

    `positions` (n, 3) in mm are where the organ is now. What is carried goes along in even measure. A part that a
    tool already cuts into now is left to the solver.
    """
    held_nodes = body.fixed[:, 0] & body.fixed[:, 1] & body.fixed[:, 2]
    held = np.flatnonzero(held_nodes[body.surface.nodes].all(axis=1))
    start = body.loading
    for number in body.moving:
        contact = body.contacts[number]
        if contact.tool.yields or goal.tools.angles[number] == start.tools.angles[number]:
            continue
        part = contact.part(held)
        free = part.gaps(body.surface.positions(positions)[held]) > -_HAIR_MM
        for share in _SHARES:
            state = start.towards(goal, float(share))
            points = body.surface.positions(positions + state.carried - start.carried)[held]
            part.angle = state.tools.angles[number]
            cut = np.flatnonzero(free & (part.gaps(points) < -_HAIR_MM))
            if len(cut):
                where = place_text(points[cut].mean(axis=0))
                return f"{contact.tool.name!r} would cut into a part that is held fast, at {where}; move it away"
    return None
