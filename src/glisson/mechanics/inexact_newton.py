"""How exactly the linear system of a Newton step is worth solving."""

import numpy as np

_ENOUGH = 0.3  # of the goal, for what the last step leaves


def step_accuracy(residual: float, before: float, goal: float, loosest: float) -> float:
    """Share of the residual that a step may leave unsolved, as the residual fell from the one before (∞ at first).

    Eisenstat and Walker 1996 (SIAM J. Sci. Comput. 17), choice 2; no more exactly than the goal needs.
    """
    wanted = min(loosest, 0.9 * (residual / before) ** 2) if np.isfinite(before) else loosest
    return max(wanted, _ENOUGH * goal / residual)
