"""Takes the body through the stages of a scenario in adaptive load steps."""

from collections.abc import Sequence
from dataclasses import replace
from math import degrees, radians

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, Event, LoadStep, StageResult
from glisson.core.model import Model
from glisson.core.protocols import Progress
from glisson.core.scenario import ContactLaw, Scenario, Stage
from glisson.core.status import Status
from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3, millinewtons_from_newtons
from glisson.mechanics.body import Body, Drag, LoadState, ToolState
from glisson.mechanics.carried_tool import CarriedTool
from glisson.mechanics.contact import ToolContact
from glisson.mechanics.contact_report import hinge_moment, report_contacts
from glisson.mechanics.elements import lumped_volumes, nodal_volumes
from glisson.mechanics.lever_tool import LeverTool
from glisson.mechanics.newton import Newton, NewtonEnd
from glisson.mechanics.sliding_rod import SlidingRod

_SMALLEST_SHARE = 1.0 / 256.0  # of a stage: smaller load steps are not tried
_SMALLEST_ANSWER = 1.0 / 16.0
_LOAD_STEPS = 4  # for a change of gravity, gas pressure or contact law, and for a node set that is carried
_FIRST_SHARE = 0.1  # of a full load step, for the first one: the tool only just comes to bear
_GROWTH = 2.0
_STIFFENINGS = 6
_NO_NEAR_EQUILIBRIUM = (Status.ITERATION_LIMIT, Status.STAGNATED)
_FLOW_SHARE = 0.5  # of a full load step: failing in larger ones may have other reasons
_FLOW_MM = 0.06  # way of an organ on which a force as large as all others acts, in the first step of the flow
_FLOW_STEPS = 40
_EASY = 12  # iterations of a step of the flow after which the drag fades faster
_THICKEST = 1e3  # of the first drag
_FIRMER = 2.0
_ROUGH_TOLERANCE = 1e-2  # while the points that cohere are sought
_FORCE_ACCURACY = 1e-3
_LARGEST_ANGLE = radians(90.0)


class StageRunner:
    """Runs all stages; every load step is an equilibrium, or the run ends with a status that says why."""

    def __init__(
        self, model: Model, scenario: Scenario, body: Body, newton: Newton, step_deg: float, progress: Progress
    ) -> None:
        self._model, self._scenario = model, scenario
        self._body, self._newton = body, newton
        self._step = radians(step_deg)
        self._progress = progress
        self._positions = np.array(model.mesh.nodes)
        self._record: list[LoadStep] = []
        self._events: list[Event] = []
        self._touched: set[str] = set()

    def run(self) -> Deformation:
        """The deformation, with the stages that were reached."""
        results: list[StageResult] = []
        for number, stage in enumerate(self._scenario.stages):
            self._number = number
            end = self._run_stage(stage)
            if end.status is Status.CONVERGED:
                end = self._without_penetration(stage)
            contacts = report_contacts(self._body, self._positions)
            rods = [part.report(self._positions) for part in self._body.parts if isinstance(part, SlidingRod)]
            rod = rods[0] if rods else None
            results.append(StageResult(stage.name, self._displacement(), end.status, contacts, rod))
            if end.status is not Status.CONVERGED:
                return self._deformation(results, end.status, _sentence(stage, end))
        missed = self._never_touched()
        if missed is not None:
            return self._deformation(results, Status.BAD_INPUT, missed)
        return self._deformation(results, Status.CONVERGED, Status.CONVERGED.sentence)

    def _run_stage(self, stage: Stage) -> NewtonEnd:
        body = self._body
        body.hold(fixed_unknowns(self._model, stage.fixed + tuple(move.node_set for move in stage.moves)))
        if self._number == 0:
            body.law = stage.contact
        gravity = self._scenario.surgery_gravity if stage.gravity else None
        external = gravity_forces(self._model, gravity)
        angles = [contact.angle for contact in body.contacts]
        for drive in stage.drives:
            if drive.angle_deg is not None:
                angles[self._contact_number(drive.lever)] = radians(drive.angle_deg)
        for motion in stage.motions:
            number = self._contact_number(motion.tool)
            tool = body.contacts[number].tool
            assert isinstance(tool, CarriedTool)  # the scenario was validated
            angles[number] = tool.set_out(angles[number], motion)
        if body.law != stage.contact and (stage.drives or stage.motions):
            # The law changes while the tools stand still, and only then do they move.
            end = self._ramp(stage, self._goal(law=stage.contact))
            if end.status is not Status.CONVERGED:
                return end
        carried = np.zeros_like(self._positions)
        for move in stage.moves:
            carried[self._model.node_set(move.node_set)] = move.displacement_mm
        tools = ToolState(tuple(angles), stage.contact)
        end = self._ramp(stage, LoadState(tools, external, carried, stage.gas_pressure_kpa))
        for drive in stage.drives:
            if drive.force_n is not None and end.status is Status.CONVERGED:
                end = self._lift_by_force(stage, drive.lever, millinewtons_from_newtons(drive.force_n))
        return end

    def _ramp(self, stage: Stage, goal: LoadState) -> NewtonEnd:
        """Go to the target, halving the load step where it fails and doubling it where it is easy."""
        start = self._body.loading
        turn = max((abs(b - a) for a, b in zip(start.tools.angles, goal.tools.angles, strict=True)), default=0.0)
        steps = max(int(np.ceil(turn / self._step - 1e-9)), 1)
        heavier = np.linalg.norm(goal.external - start.external) > 1e-9 * np.linalg.norm(goal.external)
        carrying = bool(np.any(goal.carried != start.carried))
        inflating = goal.gas_pressure_kpa != start.gas_pressure_kpa
        # Where an organ comes to rest that begins to slip depends on the way there, even where nothing is moved.
        regripping = goal.tools.law != start.tools.law
        if heavier or carrying or inflating or regripping:
            steps = max(steps, _LOAD_STEPS)
        done, share, may_flow = 0.0, _FIRST_SHARE / steps if turn > 0.0 else 1.0 / steps, not carrying
        while done < 1.0:
            reach = min(done + share, 1.0)
            self._progress((self._number + reach) / len(self._scenario.stages), self._words(stage))
            end = self._load_step(start.towards(goal, reach))
            if end.status in _NO_NEAR_EQUILIBRIUM and may_flow and (turn == 0.0 or share <= _FLOW_SHARE / steps):
                end = self._flow(start.towards(goal, reach))
                may_flow = end.status is Status.CONVERGED
            if end.status is Status.CONVERGED:
                done = 1.0 if reach > 1.0 - 1e-9 else reach
                self._accept(stage, done, end)
                share = min(share * _GROWTH, 1.0 / steps)
            elif end.status is Status.SINGULAR or share / 2.0 < _SMALLEST_SHARE / steps:
                self._note(stage, reach, end)
                return end
            else:
                share /= 2.0
        return end

    def _goal(self, angles: Sequence[float] | None = None, law: ContactLaw | None = None) -> LoadState:
        """The present state with other angles or another law."""
        present = self._body.loading
        tools = ToolState(
            present.tools.angles if angles is None else tuple(angles), present.tools.law if law is None else law
        )
        return LoadState(tools, present.external, present.carried, present.gas_pressure_kpa)

    def _load_step(self, goal: LoadState) -> NewtonEnd:
        """Equilibrium at the goal; tools, loads and anchors are put back where it is not reached."""
        body = self._body
        memory, start = body.memory(), body.loading
        moved = self._newton.advance(self._positions, goal)
        if moved is None:
            end = NewtonEnd(self._positions, Status.STAGNATED, 0, float("nan"))
        else:
            start_at = self._uninverted(moved)
            if start_at is None:
                end = NewtonEnd(self._positions, Status.INVERTED, 0, float("nan"))
            else:
                end = self._equilibrium(start_at)
        if end.status is not Status.CONVERGED:
            body.recall(memory)
            body.loading = start
        return end

    def _flow(self, goal: LoadState) -> NewtonEnd:
        """Equilibrium at the goal that is not near, as after a slip or a snap: the organ flows there.

        A drag as of a thick fluid makes every step small, anchors of friction follow, and the drag fades as the
        organ comes to rest; the end is an equilibrium without it.
        """
        body = self._body
        memory, start, before = body.memory(), body.loading, self._positions
        body.loading = goal
        balance = body.balance(before, body.touches(before))
        volumes = lumped_volumes(body.elasticity.rest, body.elasticity.mesh)
        rate = highest = balance.scale / (_FLOW_MM * float(volumes.sum()))
        iterations = 0
        for number in range(_FLOW_STEPS):
            self._progress(None, f"the organ flows to another equilibrium, step {number + 1}")
            body.drag = Drag(rate * volumes, self._positions)
            end = self._equilibrium(self._positions, exact=False)
            iterations += end.iterations
            dragging = float(np.linalg.norm(body.drag.forces(end.positions)[~body.fixed]))
            body.drag = None
            if end.status is Status.CONVERGED:
                self._positions = end.positions
                body.accept(end.positions)
                if dragging < _ROUGH_TOLERANCE * balance.scale:
                    end = self._equilibrium(end.positions)
                    iterations += end.iterations
                    if end.status is Status.CONVERGED:
                        return replace(end, iterations=iterations)
                rate *= 0.25 if end.iterations <= _EASY else 0.5
            elif rate < _THICKEST * highest:
                rate *= 4.0
            else:
                break
        self._positions, body.loading = before, start
        body.recall(memory)
        return replace(end, positions=before, status=Status.ITERATION_LIMIT, iterations=iterations)

    def _uninverted(self, moved: FloatArray) -> FloatArray | None:
        """As much of a first-order answer as inverts no element and cuts no surface.

        None where that would leave carried parts behind.
        """
        step, share = moved - self._positions, 1.0
        while share > _SMALLEST_ANSWER:
            if self._body.is_possible(self._positions + share * step):
                return self._positions + share * step
            if step[self._body.fixed].any():
                return None
            share /= 2.0
        return self._positions

    def _equilibrium(self, positions: FloatArray, exact: bool = True) -> NewtonEnd:
        """Equilibrium in which exactly the touching points cohere; only a rough one unless `exact`.

        Points that left a tool lose their cohesion between solutions, first rough and at last exact ones, until
        none has left. Points that newly touch begin to cohere where they are, which needs no force.
        """
        body, newton = self._body, self._newton
        if body.law.cohesion_kpa == 0.0:
            return newton.solve(positions, None if exact else _ROUGH_TOLERANCE)
        end, iterations = newton.solve(positions, _ROUGH_TOLERANCE), 0
        while True:
            iterations += end.iterations
            lost = body.renew_cohesion(end.positions) if end.status is Status.CONVERGED else 0
            if end.status is not Status.CONVERGED or (lost == 0 and (not exact or newton.is_exact(end))):
                return replace(end, iterations=iterations)
            end = newton.solve(end.positions, _ROUGH_TOLERANCE if lost or not exact else None)

    def _without_penetration(self, stage: Stage) -> NewtonEnd:
        """Stiffen the cushions at the end of a stage as long as a surface point lies inside a tool."""
        body = self._body
        end, penetrated = NewtonEnd(self._positions, Status.CONVERGED, 0, 0.0), self._penetrated()
        for _ in range(_STIFFENINGS):
            if not penetrated:
                break
            where = self._held_inside(penetrated[0])
            if where is not None:
                reason = (
                    f"{penetrated[0].tool.name!r} cuts into a part that is held fast, at ({where}) mm; move it away"
                )
                return replace(end, status=Status.STAGNATED, reason=reason)
            for contact in penetrated:
                contact.cushion = contact.cushion.stiffened(_FIRMER)
            end = self._load_step(body.loading)
            if end.status is not Status.CONVERGED:
                return end
            self._accept(stage, 1.0, end)
            penetrated = self._penetrated()
        if penetrated:
            return replace(end, status=Status.STAGNATED, reason="a tool stays inside the organ")
        return end

    def _penetrated(self) -> list[ToolContact]:
        """Tools, other than yielding ones, inside which a surface point lies."""
        points = self._body.surface.positions(self._positions)
        return [c for c in self._body.contacts if not c.tool.yields and float(c.gaps(points).min()) <= 0.0]

    def _held_inside(self, contact: ToolContact) -> str | None:
        """Where a tool is deepest in the organ, if that is a part that can't give way."""
        body = self._body
        points = body.surface.positions(self._positions)
        deepest = int(contact.gaps(points).argmin())
        if not body.fixed[body.surface.nodes[deepest]].all():
            return None
        return ", ".join(f"{x:.0f}" for x in points[deepest])

    def _accept(self, stage: Stage, reach: float, end: NewtonEnd) -> None:
        body = self._body
        self._positions = end.positions
        body.accept(end.positions)
        self._note(stage, reach, end)
        for contact, touch in zip(body.contacts, body.touches(end.positions, update_friction=False), strict=True):
            name, touching = contact.tool.name, bool(len(touch.points))
            if contact.tool.moves and name in self._touched and not touching:
                self._touched.discard(name)
                at = degrees(contact.angle) if isinstance(contact.tool, LeverTool) else None
                self._events.append(Event("lost_contact", name, at))
            if touching:
                self._touched.add(name)

    def _lift_by_force(self, stage: Stage, lever: str, force_mn: float) -> NewtonEnd:
        """Turn the lever until the organ's moment about the hinge balances a force on the lever's end."""
        body = self._body
        number = self._contact_number(lever)
        contact = body.contacts[number]
        assert isinstance(contact.tool, LeverTool)  # the scenario was validated
        wanted = force_mn * contact.tool.lever.length_mm
        end = NewtonEnd(self._positions, Status.CONVERGED, 0, 0.0)
        turn, slope, missing = _FIRST_SHARE * self._step, 0.0, wanted - self._moment(number)
        while missing > _FORCE_ACCURACY * wanted:
            angle = contact.angle
            if angle + turn > _LARGEST_ANGLE:
                reason = f"the organ does not resist the force on {lever!r}: the lever turned beyond 90°"
                return NewtonEnd(self._positions, Status.STAGNATED, end.iterations, end.residual, reason)
            goal = [c.angle for c in body.contacts]
            goal[number] = angle + turn
            before, memory = self._positions, body.memory()
            end = self._load_step(self._goal(angles=goal))
            if end.status is Status.CONVERGED:
                reached = wanted - self._moment(number, end.positions)
                if reached >= -_FORCE_ACCURACY * wanted:
                    slope = (missing - reached) / turn
                    self._accept(stage, 1.0 - reached / wanted, end)
                    # Now, because a stiffer cushion also pushes more.
                    end = self._without_penetration(stage)
                    if end.status is not Status.CONVERGED:
                        return end
                    missing = wanted - self._moment(number)
                    turn = min(self._step, _GROWTH * turn, max(missing / slope, 1e-6) if slope > 0.0 else np.inf)
                    continue
                # Too far: go back, so that friction sees a lever that only ever rises.
                slope = (missing - reached) / turn
                self._positions = before
                body.recall(memory)
                turn = max(0.99 * missing / slope, 0.1 * turn)
            elif end.status is Status.SINGULAR or turn < 1e-5:
                return end
            else:
                turn /= 2.0
        return end

    def _moment(self, number: int, positions: FloatArray | None = None) -> float:
        return hinge_moment(self._body, number, self._positions if positions is None else positions)

    def _contact_number(self, name: str) -> int:
        return next(n for n, contact in enumerate(self._body.contacts) if contact.tool.name == name)

    def _never_touched(self) -> str | None:
        """A sentence about a driven lever that missed the organ in every load step."""
        driven = {drive.lever for stage in self._scenario.stages for drive in stage.drives}
        lost = {event.tool for event in self._events}
        for name in sorted(driven - self._touched - lost):
            contact = self._body.contacts[self._contact_number(name)]
            gap = float(contact.gaps(self._body.surface.positions(self._positions)).min())
            return (
                f"Lever {name!r} never touched the organ: at {degrees(contact.angle):.0f}° it still is {gap:.1f} mm "
                "away; move its hinge, lengthen it or turn it further."
            )
        return None

    def _note(self, stage: Stage, reach: float, end: NewtonEnd) -> None:
        energy = self._body.energy(end.positions)
        self._record.append(LoadStep(stage.name, reach, end.iterations, end.residual, energy, end.status))

    def _words(self, stage: Stage) -> str:
        angles = [f"{degrees(c.angle):.0f}°" for c in self._body.contacts if isinstance(c.tool, LeverTool)]
        return f"{stage.name}: lever at {', '.join(angles)}" if angles else stage.name

    def _displacement(self) -> FloatArray:
        return self._positions - self._model.mesh.nodes

    def _deformation(self, stages: list[StageResult], status: Status, message: str) -> Deformation:
        return Deformation(self._model.mesh, tuple(stages), status, message, tuple(self._record), tuple(self._events))


def gravity_forces(model: Model, direction: FloatArray | None) -> FloatArray:
    """Weight of the scanned shape as nodal forces (n, 3) in mN along a unit direction (None: weightless)."""
    if direction is None:
        return np.zeros_like(model.mesh.nodes)
    densities = {n: density_from_kg_m3(m.density_kg_m3) for n, m in model.materials.items()}
    factors = np.array([densities[int(region)] for region in model.mesh.region_numbers])
    masses = nodal_volumes(model.mesh.nodes, model.mesh, factors)
    weights: FloatArray = masses[:, None] * STANDARD_GRAVITY_MM_S2 * direction
    return weights


def fixed_unknowns(model: Model, names: tuple[str, ...]) -> NDArray[np.bool_]:
    """Which unknowns (n, 3) the named node sets hold.

    Raises:
        BadInput: the model has no such set.
    """
    fixed = np.zeros(model.mesh.nodes.shape, dtype=bool)
    for name in names:
        fixed[model.node_set(name)] = True
    return fixed


def _sentence(stage: Stage, end: NewtonEnd) -> str:
    reason = end.reason or end.status.sentence.rstrip(".").lower()
    return f"Stage {stage.name!r} did not reach equilibrium (relative residual {end.residual:.1e}): {reason}."
