"""The lifts: unseen livers, how they were truly lifted, and how the plan that is to be adjusted is off."""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.scenario import ContactLaw, LeverDrive, Scenario
from glisson.core.tools import Lever
from glisson.phantom.lever_lift import COHESION_KPA, lever_lift
from glisson.phantom.lift_truths import UNSEEN_TRUTHS, LiftTruth
from glisson.phantom.proportions import draw_proportions

FIRST_MEMBER = 700
"""Members of the phantom family from here on are this study's; parameters are tuned on earlier ones."""

_ANGLES_DEG = (15.0, 35.0)
_MODULI_KPA, _POISSON_RATIOS, _FRICTIONS = (5.0, 14.0), (0.44, 0.49), (0.05, 0.3)
_PLACED_MM = 5.0
_ANGLE_OFF_DEG, _PLACE_OFF_MM = 3.0, 3.0


@dataclass(frozen=True)
class LeverCase:
    """One lift.

    The truth turns the lever to `angle_deg` from a hinge that is off the family's by `placed_mm` along its arm and its
    axis; the plan has an angle and a place that are off the truth by `angle_off_deg` and `place_off_mm`. `calculix`
    names the truth of `UNSEEN_TRUTHS` that the other engine has solved; None: our own, finer and different.
    """

    member: int
    calculix: str | None
    angle_deg: float
    placed_mm: tuple[float, float]
    young_modulus_kpa: float
    poisson_ratio: float
    friction: float
    angle_off_deg: float
    place_off_mm: tuple[float, float]


def draw_case(member: int) -> LeverCase:
    """The lift of a member; where CalculiX has solved one, that one."""
    random = np.random.default_rng([member, 6])
    low, high = np.log(_MODULI_KPA)
    own = LeverCase(
        member=member,
        calculix=None,
        angle_deg=float(random.uniform(*_ANGLES_DEG)),
        placed_mm=_pair(random.uniform(-_PLACED_MM, _PLACED_MM, size=2)),
        young_modulus_kpa=float(np.exp(random.uniform(low, high))),
        poisson_ratio=float(random.uniform(*_POISSON_RATIOS)),
        friction=float(random.uniform(*_FRICTIONS)),
        angle_off_deg=float(_ANGLE_OFF_DEG * random.normal()),
        place_off_mm=_pair(_PLACE_OFF_MM * random.normal(size=2)),
    )
    known = _solved(member)
    if known is None:
        return own
    return replace(
        own,
        calculix=known.name,
        angle_deg=known.angle_deg,
        placed_mm=(0.0, 0.0),
        young_modulus_kpa=known.young_modulus_kpa,
        poisson_ratio=known.poisson_ratio,
        friction=known.friction,
    )


def true_scenario(case: LeverCase) -> Scenario:
    """The manoeuvre as it was."""
    return _lift(case, case.angle_deg, np.array(case.placed_mm), case.friction)


def planned_scenario(case: LeverCase, friction: float) -> Scenario:
    """The manoeuvre as it was planned, by someone who takes friction to be `friction`."""
    place = np.add(case.placed_mm, case.place_off_mm)
    return _lift(case, case.angle_deg + case.angle_off_deg, place, friction)


def lever_of(scenario: Scenario) -> Lever:
    """The lever of a lift."""
    return next(tool for tool in scenario.tools if isinstance(tool, Lever))


def _lift(case: LeverCase, angle_deg: float, placed_mm: FloatArray, friction: float) -> Scenario:
    scenario = lever_lift(draw_proportions(case.member))
    board, lever = scenario.tools
    assert isinstance(lever, Lever)
    hinge = lever.hinge_mm + placed_mm[0] * lever.arm + placed_mm[1] * lever.axis
    lift, settle = scenario.stages
    lift = replace(
        lift, contact=ContactLaw(friction, COHESION_KPA), drives=(LeverDrive(lever.name, angle_deg=angle_deg),)
    )
    settle = replace(settle, contact=ContactLaw(friction))
    return replace(scenario, tools=(board, replace(lever, hinge_mm=hinge)), stages=(lift, settle))


def _solved(member: int) -> LiftTruth | None:
    return next((truth for truth in UNSEEN_TRUTHS if truth.seed == member and truth.path.is_file()), None)


def _pair(values: FloatArray) -> tuple[float, float]:
    return float(values[0]), float(values[1])
