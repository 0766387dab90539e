"""Turns a lever by a force on its end, as a hand or a gauge does, and not by an angle."""

from collections.abc import Sequence
from dataclasses import replace
from math import radians

import numpy as np

from glisson.core.status import Status
from glisson.mechanics.body import LoadState
from glisson.mechanics.contact_report import hinge_moment
from glisson.mechanics.lever_tool import LeverTool
from glisson.mechanics.load_path import FIRST_SHARE, GROWTH, LoadPath
from glisson.mechanics.newton import NewtonEnd

_FORCE_ACCURACY = 1e-3
_LARGEST_ANGLE = radians(90.0)


def lift_by_force(path: LoadPath, lever: str, force_mn: float) -> NewtonEnd:
    """Turn the lever until the organ's moment about the hinge balances a force on the lever's end."""
    body = path.body
    number = body.contact_number(lever)
    contact = body.contacts[number]
    assert isinstance(contact.tool, LeverTool)  # the scenario was validated
    wanted = force_mn * contact.tool.lever.length_mm
    end = NewtonEnd(path.positions, Status.CONVERGED, 0, 0.0)
    turn, slope, missing = FIRST_SHARE * path.step_rad, 0.0, wanted - hinge_moment(body, number, path.positions)
    while missing > _FORCE_ACCURACY * wanted:
        angle = contact.angle
        if angle + turn > _LARGEST_ANGLE:
            reason = f"the organ does not resist the force on {lever!r}: the lever turned beyond 90°"
            return NewtonEnd(path.positions, Status.STAGNATED, end.iterations, end.residual, reason)
        goal = [c.angle for c in body.contacts]
        goal[number] = angle + turn
        before, memory = path.positions, body.memory()
        end = path.load_step(_turned(body.loading, goal))
        if end.status is Status.CONVERGED:
            reached = wanted - hinge_moment(body, number, end.positions)
            if reached >= -_FORCE_ACCURACY * wanted:
                slope = (missing - reached) / turn
                share = 1.0 - reached / wanted
                path.accept(share, end)
                # Now, because a stiffer cushion also pushes more.
                end = path.without_penetration(reach=share)
                if end.status is not Status.CONVERGED:
                    return end
                missing = wanted - hinge_moment(body, number, path.positions)
                turn = min(path.step_rad, GROWTH * turn, max(missing / slope, 1e-6) if slope > 0.0 else np.inf)
                continue
            # Too far: go back, so that friction sees a lever that only ever rises.
            slope = (missing - reached) / turn
            path.positions = before
            body.recall(memory)
            turn = max(0.99 * missing / slope, 0.1 * turn)
        elif end.status is Status.SINGULAR or turn < 1e-5:
            return end
        else:
            turn /= 2.0
    return end


def _turned(state: LoadState, angles: Sequence[float]) -> LoadState:
    return replace(state, tools=replace(state.tools, angles=tuple(angles)))
