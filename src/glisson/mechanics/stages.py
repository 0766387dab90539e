"""Takes the organ through the stages of a scenario, one after the other."""

from collections.abc import Iterator
from dataclasses import replace
from math import degrees, radians
from typing import Protocol

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.model import Model
from glisson.core.protocols import Progress
from glisson.core.scenario import Scenario, Stage
from glisson.core.status import Status
from glisson.core.units import millinewtons_from_newtons
from glisson.mechanics.body import Body, LoadState, ToolState
from glisson.mechanics.carried_tool import CarriedTool
from glisson.mechanics.contact_report import report_contacts
from glisson.mechanics.force_drive import lift_by_force
from glisson.mechanics.held_in_the_way import held_in_the_way
from glisson.mechanics.lever_tool import LeverTool
from glisson.mechanics.load_path import History, LoadPath
from glisson.mechanics.loads import fixed_unknowns, gravity_forces
from glisson.mechanics.newton import Newton, NewtonEnd
from glisson.mechanics.sliding_rod import SlidingRod


class Carrier(Protocol):
    """Brings the organ from an equilibrium to a goal."""

    estimated_error: FloatArray | None
    """Of the node positions (n,) in mm, by what was left out so far; None where nothing is."""

    def carry(self, path: LoadPath, goal: LoadState) -> NewtonEnd:
        """Take the path's body there, or as far as it goes."""


class WholeOrgan:
    """The `Carrier` that solves the whole organ in every load step."""

    estimated_error: FloatArray | None = None

    def carry(self, path: LoadPath, goal: LoadState) -> NewtonEnd:
        """In adaptive load steps."""
        return path.ramp(goal)


class StageRunner:
    """Runs all stages; every load step is an equilibrium, or the run ends with a status that says why."""

    def __init__(
        self,
        model: Model,
        scenario: Scenario,
        body: Body,
        newton: Newton,
        carrier: Carrier,
        step_deg: float,
        progress: Progress,
    ) -> None:
        self._model, self._scenario = model, scenario
        self._body = body
        self._carrier = carrier
        self._progress = progress
        self._path = LoadPath(body, newton, model.mesh.nodes, step_deg, History(), self._tell)
        self._number = 0

    def run(self) -> Deformation:
        """The deformation, with the stages that were reached."""
        results: list[StageResult] = []
        for number, stage in enumerate(self._scenario.stages):
            self._number = number
            self._path.history.stage = stage.name
            end = self._run_stage(stage)
            if end.status is Status.CONVERGED:
                end = self._path.without_penetration()
            positions = self._path.positions
            contacts = report_contacts(self._body, positions)
            rods = [part.report(positions) for part in self._body.parts if isinstance(part, SlidingRod)]
            rod = rods[0] if rods else None
            results.append(StageResult(stage.name, positions - self._model.mesh.nodes, end.status, contacts, rod))
            if end.status is not Status.CONVERGED:
                return self._deformation(results, end.status, self._sentence(stage, end))
        missed = self._never_touched()
        if missed is not None:
            return self._deformation(results, Status.BAD_INPUT, missed)
        return self._deformation(results, Status.CONVERGED, Status.CONVERGED.sentence)

    def _run_stage(self, stage: Stage) -> NewtonEnd:
        body = self._body
        body.hold(fixed_unknowns(self._model, stage.fixed + tuple(move.node_set for move in stage.moves)))
        if self._number == 0:
            body.law = stage.contact
        for goal in self._goals(stage):
            blocked = held_in_the_way(body, self._path.positions, goal)
            if blocked is not None:
                return NewtonEnd(self._path.positions, Status.BAD_INPUT, 0, float("nan"), blocked)
            end = self._carrier.carry(self._path, goal)
            if end.status is not Status.CONVERGED:
                return end
        for drive in stage.drives:
            if drive.force_n is not None and end.status is Status.CONVERGED:
                end = lift_by_force(self._path, drive.lever, millinewtons_from_newtons(drive.force_n))
        return end

    def _goals(self, stage: Stage) -> Iterator[LoadState]:
        """Where the stage takes the body; where its law changes and tools move, the law first."""
        body = self._body
        if body.law != stage.contact and (stage.drives or stage.motions):
            present = body.loading
            yield replace(present, tools=replace(present.tools, law=stage.contact))
        angles = [contact.angle for contact in body.contacts]
        for drive in stage.drives:
            if drive.angle_deg is not None:
                angles[body.contact_number(drive.lever)] = radians(drive.angle_deg)
        for motion in stage.motions:
            number = body.contact_number(motion.tool)
            tool = body.contacts[number].tool
            assert isinstance(tool, CarriedTool)  # the scenario was validated
            angles[number] = tool.set_out(angles[number], motion)
        carried = np.zeros_like(self._model.mesh.nodes)
        for move in stage.moves:
            carried[self._model.node_set(move.node_set)] = move.displacement_mm
        external = gravity_forces(self._model, self._scenario.surgery_gravity if stage.gravity else None)
        yield LoadState(ToolState(tuple(angles), stage.contact), external, carried, stage.gas_pressure_kpa)

    def _never_touched(self) -> str | None:
        """A sentence about a moved tool that bore the organ in no load step, and is away from it at the end."""
        stages = self._scenario.stages
        levers = {drive.lever for stage in stages for drive in stage.drives}
        driven = levers | {motion.tool for stage in stages for motion in stage.motions}
        for name in sorted(driven - self._path.history.met):
            contact = self._body.contacts[self._body.contact_number(name)]
            gap = float(contact.gaps(self._body.surface.positions(self._path.positions)).min())
            if gap <= contact.cushion.range_mm:
                continue  # it lies against the organ and goes along, though it bears nothing
            if name not in levers:
                return f"Tool {name!r} never touched the organ: it ends {gap:.1f} mm away; move it further."
            return (
                f"Lever {name!r} never touched the organ: at {degrees(contact.angle):.0f}° it still is {gap:.1f} mm "
                "away; move its hinge, lengthen it or turn it further."
            )
        return None

    def _tell(self, reach: float | None, special: str | None) -> None:
        stages = self._scenario.stages
        levers = [f"{degrees(c.angle):.0f}°" for c in self._body.contacts if isinstance(c.tool, LeverTool)]
        name = stages[self._number].name
        words = special or (f"{name}: lever at {', '.join(levers)}" if levers else name)
        self._progress(None if reach is None else (self._number + reach) / len(stages), words)

    def _sentence(self, stage: Stage, end: NewtonEnd) -> str:
        reason = end.reason or end.status.sentence.rstrip(".").lower()
        # What could not even be begun has no residual; and where it is small, it is not what is wrong.
        left = f" (relative residual {end.residual:.1e})" if end.residual > self._path.newton.settings.tolerance else ""
        return f"Stage {stage.name!r} did not reach equilibrium{left}: {reason}."

    def _deformation(self, stages: list[StageResult], status: Status, message: str) -> Deformation:
        history = self._path.history
        steps, events, error = tuple(history.record), tuple(history.events), self._carrier.estimated_error
        return Deformation(self._model.mesh, tuple(stages), status, message, steps, events, error)
