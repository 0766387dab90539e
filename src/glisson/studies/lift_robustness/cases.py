"""The drawn lifts: member of the family, place and angle of the lever, tissue, contact."""

from dataclasses import dataclass

import numpy as np

FIRST_MEMBER = 1000
"""Members of the phantom family from here on are this study's; tests and demo show earlier ones."""

LARGEST_ANGLE_DEG = 35.0

_AT_AN_END = 0.25
"""In so many cases a parameter is at an end of its range, where trouble is likeliest."""


@dataclass(frozen=True)
class LiftCase:
    """One drawn lift.

    The hinge lies on the board at `hinge_x_mm`, `hinge_z_mm` of the nominal member; `turn_deg` turns the
    lever on the board, about the vertical, away from the patient's left. Cohesion acts in stage 1.
    """

    member: int
    hinge_x_mm: float
    hinge_z_mm: float
    turn_deg: float
    angle_deg: float
    young_modulus_kpa: float
    poisson_ratio: float
    friction: float
    cohesion_kpa: float


EASY_CASE = LiftCase(
    member=FIRST_MEMBER,
    hinge_x_mm=-6.0,
    hinge_z_mm=15.0,
    turn_deg=0.0,
    angle_deg=5.0,
    young_modulus_kpa=100.0,
    poisson_ratio=0.45,
    friction=0.1,
    cohesion_kpa=10.0,
)
"""A lift that is not drawn, by a small angle."""


def draw_case(seed: int, number: int) -> LiftCase:
    """Case `number` (from 0 on) of a seed; each case has a liver of its own."""
    random = np.random.default_rng([seed, number])

    def drawn(low: float, high: float) -> float:
        inner, end, at_end = random.uniform(low, high), random.choice([low, high]), random.uniform() < _AT_AN_END
        return float(end if at_end else inner)

    return LiftCase(
        member=FIRST_MEMBER + int(random.integers(0, 2**31)),
        hinge_x_mm=float(random.uniform(-14.0, 12.0)),
        hinge_z_mm=float(random.uniform(2.0, 32.0)),
        turn_deg=float(random.uniform(-20.0, 20.0)),
        angle_deg=drawn(10.0, LARGEST_ANGLE_DEG),
        young_modulus_kpa=float(np.exp(drawn(np.log(3.0), np.log(700.0)))),
        poisson_ratio=drawn(0.3, 0.499),
        friction=drawn(0.0, 0.5),
        cohesion_kpa=float(random.choice([0.0, 10.0])),
    )
