"""The manoeuvre of the dissertation's chapter 4 on a member of the family: board, lever, two stages."""

import numpy as np

from glisson.core.scenario import ContactLaw, LeverDrive, Scenario, Stage
from glisson.core.tools import Board, Lever
from glisson.phantom.proportions import Proportions

LEVER_ANGLE_DEG = 22.0
"""Where stage 1 takes the lever."""

FRICTION = 0.1
COHESION_KPA = 10.0

_DOWN = np.array([0.0, 1.0, 0.0])


def lever_lift(proportions: Proportions) -> Scenario:
    """Liver on a board, lever in a slot of the board under the left lobe (its top face flush at 0°).

    Stage 1 lifts with sticky contact (µ p + c, c = 10 kPa as in the dissertation); stage 2 lets the lobe
    settle under plain Coulomb friction. The lever lies off the lobe's middle, because in the middle two
    states of the lobe, rolled to either side, are possible.
    """
    board = Board("board", np.zeros(3), -_DOWN)
    hinge = proportions.place([-6.0, 0.0, 15.0])
    lever = Lever.lifting("lever", hinge, np.array([1.0, 0.0, 0.0]), -_DOWN)
    lift = Stage("stage 1", ContactLaw(FRICTION, COHESION_KPA), (LeverDrive("lever", angle_deg=LEVER_ANGLE_DEG),))
    settle = Stage("stage 2", ContactLaw(FRICTION, 0.0))
    return Scenario(
        tools=(board, lever),
        stages=(lift, settle),
        scan_gravity=_DOWN,
        surgery_gravity=_DOWN,
        scan_supports=("board",),
    )
