"""What of a planned manoeuvre is not known exactly: the lever's angle and place, friction, stiffness, attachments."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.model import Model
from glisson.core.scenario import ContactLaw, LeverDrive, Scenario
from glisson.core.tools import Lever
from glisson.mechanics.lever_tool import LeverTool

Plan = tuple[Model, Scenario]

_BELOW_MM = 100.0


@dataclass(frozen=True)
class Doubt:
    """Standard deviations around a plan: of angles (degrees), places (mm), and factors of what cannot be negative."""

    angle_deg: float
    place_mm: float
    friction_factor: float
    stiffness_factor: float
    attachment_factor: float


@dataclass(frozen=True)
class Unknown:
    """One of them: its name, how a plan changes when it is off by some standard deviations, and what that is in words.

    `changed` takes a plan and the amount, `told` the amount and its standard deviation.
    """

    name: str
    changed: Callable[[Plan, float], Plan]
    told: Callable[[float, float], str]


class ScenarioUnknowns:
    """The unknowns of a plan, each counted in its standard deviations from the plan.

    Args:
        model: the organ.
        scenario: the manoeuvre as planned.
        doubt: how far it may be off.

    Raises:
        BadInput: no stage turns a lever to an angle.
    """

    def __init__(self, model: Model, scenario: Scenario, doubt: Doubt) -> None:
        self._plan = (model, scenario)
        self.levers = _levers(scenario)
        every = [unknown for name in self.levers for unknown in _of_lever(scenario, name, doubt)]
        if any(stage.contact.friction > 0.0 for stage in scenario.stages):
            every.append(_factor("friction", doubt.friction_factor, _with_friction))
        every.append(_factor("stiffness", doubt.stiffness_factor, _with_stiffness))
        if model.ligaments:
            every.append(_factor("stiffness of the attachments", doubt.attachment_factor, _with_attachments))
        self.every: tuple[Unknown, ...] = tuple(every)

    def at(self, amounts: FloatArray) -> Plan:
        """Model and scenario with the unknowns at `amounts` (k,)."""
        plan = self._plan
        for unknown, amount in zip(self.every, amounts, strict=True):
            plan = unknown.changed(plan, float(amount))
        return plan

    def told(self, amounts: FloatArray, sigma: FloatArray) -> str:
        """All unknowns at `amounts` (k,) with standard deviations (k,), in words."""
        each = zip(self.every, amounts, sigma, strict=True)
        return ", ".join(unknown.told(float(amount), float(width)) for unknown, amount, width in each)

    def lever_gaps(self, name: str, points_mm: FloatArray, amounts: FloatArray) -> FloatArray:
        """Distance (n,) in mm of points (n, 3) from a lever's upper side at the manoeuvre's end, negative below it."""
        _, scenario = self.at(amounts)
        lever = _lever(scenario, name)
        # The organ lies on it, so what is deep inside the bar came from above, not from the nearer underside.
        tool = LeverTool(replace(lever, thickness_mm=lever.thickness_mm + _BELOW_MM))
        axes, origin = tool.pose(np.radians(_angle_deg(scenario, name)))
        return tool.distance((points_mm - origin) @ axes)


def _levers(scenario: Scenario) -> tuple[str, ...]:
    turned = [drive.lever for stage in scenario.stages for drive in stage.drives if drive.angle_deg is not None]
    if not turned:
        raise BadInput("The scenario turns no lever to an angle, and there is nothing else that could be adjusted.")
    return tuple(dict.fromkeys(turned))


def _lever(scenario: Scenario, name: str) -> Lever:
    return next(tool for tool in scenario.tools if isinstance(tool, Lever) and tool.name == name)


def _angle_deg(scenario: Scenario, name: str) -> float:
    drives = [drive for stage in scenario.stages for drive in stage.drives if drive.lever == name]
    return next(float(drive.angle_deg) for drive in reversed(drives) if drive.angle_deg is not None)


def _of_lever(scenario: Scenario, name: str, doubt: Doubt) -> Sequence[Unknown]:
    planned = _angle_deg(scenario, name)

    def turned(plan: Plan, amount: float) -> Plan:
        return plan[0], _turned(plan[1], name, amount * doubt.angle_deg)

    def moved(along: FloatArray) -> Callable[[Plan, float], Plan]:
        return lambda plan, amount: (plan[0], _moved(plan[1], name, amount * doubt.place_mm * along))

    def angle(amount: float, sigma: float) -> str:
        found = planned + amount * doubt.angle_deg
        return f"angle of {name} {found:.1f} ± {sigma * doubt.angle_deg:.1f}° (planned {planned:.1f}°)"

    def shift(which: str) -> Callable[[float, float], str]:
        size = doubt.place_mm
        return lambda amount, sigma: f"{name} off {which} by {amount * size:+.1f} ± {sigma * size:.1f} mm"

    lever = _lever(scenario, name)
    return (
        Unknown(f"the angle of {name}", turned, angle),
        Unknown(f"the place of {name} along its arm", moved(lever.arm), shift("along its arm")),
        Unknown(f"the place of {name} along its hinge", moved(lever.axis), shift("along its hinge")),
    )


def _turned(scenario: Scenario, name: str, by_deg: float) -> Scenario:
    """Every angle that a stage takes the lever to is off by the same."""

    def driven(drive: LeverDrive) -> LeverDrive:
        if drive.lever != name or drive.angle_deg is None:
            return drive
        return LeverDrive(name, angle_deg=drive.angle_deg + by_deg)

    stages = [replace(stage, drives=tuple(driven(drive) for drive in stage.drives)) for stage in scenario.stages]
    return replace(scenario, stages=tuple(stages))


def _moved(scenario: Scenario, name: str, by_mm: FloatArray) -> Scenario:
    tools = [
        replace(tool, hinge_mm=tool.hinge_mm + by_mm) if isinstance(tool, Lever) and tool.name == name else tool
        for tool in scenario.tools
    ]
    return replace(scenario, tools=tuple(tools))


def _factor(name: str, factor: float, scaled: Callable[[Plan, float], Plan]) -> Unknown:
    def told(amount: float, sigma: float) -> str:
        return f"{name} × {factor**amount:.2f} (× or ÷ {factor**sigma:.2f})"

    return Unknown(f"the {name}", lambda plan, amount: scaled(plan, factor**amount), told)


def _with_friction(plan: Plan, factor: float) -> Plan:
    model, scenario = plan
    stages = [
        replace(stage, contact=ContactLaw(factor * stage.contact.friction, stage.contact.cohesion_kpa))
        for stage in scenario.stages
    ]
    return model, replace(scenario, stages=tuple(stages))


def _with_stiffness(plan: Plan, factor: float) -> Plan:
    model, scenario = plan
    materials = {
        number: replace(material, young_modulus_kpa=factor * material.young_modulus_kpa)
        for number, material in model.materials.items()
    }
    return replace(model, materials=materials), scenario


def _with_attachments(plan: Plan, factor: float) -> Plan:
    model, scenario = plan
    return replace(model, ligaments={name: factor * value for name, value in model.ligaments.items()}), scenario
