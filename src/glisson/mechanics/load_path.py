"""One body on its way through load steps: each an equilibrium, or an end that says why there is none."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import degrees, radians

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Event, LoadStep
from glisson.core.status import Status
from glisson.mechanics.bend import Bend
from glisson.mechanics.body import Body, Drag, LoadState
from glisson.mechanics.contact import ToolContact
from glisson.mechanics.elements import lumped_volumes
from glisson.mechanics.lever_tool import LeverTool
from glisson.mechanics.newton import Newton, NewtonEnd

_SMALLEST_SHARE = 1.0 / 256.0  # of a stage: smaller load steps are not tried
_SMALLEST_ANSWER = 1.0 / 16.0
_LOAD_STEPS = 4  # for a change of gravity, gas pressure or contact law, and for a node set that is carried
FIRST_SHARE = 0.1  # of a full load step, for the first one: the tool only just comes to bear
GROWTH = 2.0
_STIFFENINGS = 10
_NO_NEAR_EQUILIBRIUM = (Status.ITERATION_LIMIT, Status.STAGNATED)
_FLOW_SHARE = 0.5  # of a full load step: failing in larger ones may have other reasons
_FLOW_MM = 0.06  # way of an organ on which a force as large as all others acts, in the first step of the flow
_FLOW_STEPS = 40
_DEEP = 1.0  # in ranges of the cushion
_EASY = 12  # iterations of a step of the flow after which the drag fades faster
_THICKEST = 1e3  # of the first drag
_FIRMER = 2.0
_BEARS_MN = 1.0  # a tool that presses less only grazes the organ
_ROUGH_TOLERANCE = 1e-2  # while the points that cohere are sought


@dataclass(eq=False)
class History:
    """What happened in the load steps so far, in the stage of name `stage`.

    `met` are tools that have borne the organ at some time, `bearing` those that bear it now.
    """

    stage: str = ""
    record: list[LoadStep] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    met: set[str] = field(default_factory=set)
    bearing: set[str] = field(default_factory=set)

    def extend(self, other: "History") -> None:
        """Go on with what happened to a part of the body meanwhile."""
        self.record += other.record
        self.events += other.events
        self.met |= other.met
        self.bearing = other.bearing


class LoadPath:
    """Takes a body from load to load, in adaptive steps.

    Args:
        body: the body, whose loads and friction go along.
        newton: finds its equilibria.
        positions: node positions (n, 3) in mm, an equilibrium of the body as it is.
        step_deg: largest turn of a lever in one load step, degrees.
        history: goes on with what happens.
        progress: told the share of the way to a goal that is being tried (None: unknown), and what is special.
    """

    def __init__(
        self,
        body: Body,
        newton: Newton,
        positions: FloatArray,
        step_deg: float,
        history: History,
        progress: Callable[[float | None, str | None], None],
    ) -> None:
        self.body, self.newton = body, newton
        self.positions = np.array(positions)
        self.history = history
        self.steps: list[tuple[float, FloatArray]] = []
        self.step_rad = radians(step_deg)
        self.progress = progress

    def ramp(self, goal: LoadState) -> NewtonEnd:
        """Go to the target, halving the load step where it fails and doubling it where it is easy.

        Leaves in `steps` the shares of the way and the positions (n, 3) of the equilibria on it.
        """
        self.steps = []
        start, origin = self.body.loading, self.positions
        turn = max((abs(b - a) for a, b in zip(start.tools.angles, goal.tools.angles, strict=True)), default=0.0)
        steps = max(int(np.ceil(turn / self.step_rad - 1e-9)), 1)
        heavier = np.linalg.norm(goal.external - start.external) > 1e-9 * np.linalg.norm(goal.external)
        carrying = bool(np.any(goal.carried != start.carried))
        inflating = goal.gas_pressure_kpa != start.gas_pressure_kpa
        # Where an organ comes to rest that begins to slip depends on the way there, even where nothing is moved.
        regripping = goal.tools.law != start.tools.law
        if heavier or carrying or inflating or regripping:
            steps = max(steps, _LOAD_STEPS)
        done, share, may_flow = 0.0, FIRST_SHARE / steps if turn > 0.0 else 1.0 / steps, not carrying
        while done < 1.0:
            reach = min(done + share, 1.0)
            self.progress(reach, None)
            end = self.load_step(start.towards(goal, reach), self._bend(reach - done, done, origin))
            if end.status in _NO_NEAR_EQUILIBRIUM and may_flow and (turn == 0.0 or share <= _FLOW_SHARE / steps):
                flowed = self._flow(start.towards(goal, reach))
                if flowed is not None:
                    end, may_flow = flowed, flowed.status is Status.CONVERGED
            if end.status is Status.CONVERGED:
                done = 1.0 if reach > 1.0 - 1e-9 else reach
                self.accept(done, end)
                share = min(share * GROWTH, 1.0 / steps)
            elif end.status is Status.SINGULAR or share / 2.0 < _SMALLEST_SHARE / steps:
                self.note(reach, end)
                return end
            else:
                share /= 2.0
        return end

    def without_penetration(self, margin: float = 0.0, reach: float = 1.0) -> NewtonEnd:
        """Stiffen the cushions as long as a surface point lies inside a tool, at a share of the way (at its end).

        With a `margin`, as long as one has left no such share of the cushion.
        """
        body = self.body
        end, penetrated = NewtonEnd(self.positions, Status.CONVERGED, 0, 0.0), self._penetrated(self.positions, margin)
        for _ in range(_STIFFENINGS):
            if not penetrated:
                break
            for contact in penetrated:
                contact.cushion = contact.cushion.stiffened(_FIRMER)
            end = self.load_step(body.loading)
            if end.status is not Status.CONVERGED:
                return end
            self.accept(reach, end)
            penetrated = self._penetrated(self.positions, margin)
        if self._penetrated(self.positions, 0.0):
            return replace(end, status=Status.STAGNATED, reason="a tool stays inside the organ")
        return end

    def equilibrium(self, positions: FloatArray, exact: bool = True) -> NewtonEnd:
        """Equilibrium in which exactly the touching points cohere; only a rough one unless `exact`.

        Points that left a tool lose their cohesion between solutions, first rough and at last exact ones, until
        none has left. Points that newly touch begin to cohere where they are, which needs no force.
        """
        body, newton = self.body, self.newton
        if body.law.cohesion_kpa == 0.0:
            return newton.solve(positions, None if exact else _ROUGH_TOLERANCE)
        end, iterations = newton.solve(positions, _ROUGH_TOLERANCE), 0
        while True:
            iterations += end.iterations
            lost = body.renew_cohesion(end.positions) if end.status is Status.CONVERGED else 0
            if end.status is not Status.CONVERGED or (lost == 0 and (not exact or newton.is_exact(end))):
                return replace(end, iterations=iterations)
            end = newton.solve(end.positions, _ROUGH_TOLERANCE if lost or not exact else None)

    def _bend(self, share: float, done: float, origin: FloatArray) -> Bend | None:
        """What the last load step tells of the next one, a share of the way; None where contact makes that rough."""
        if not self.steps or self.body.contacts:
            return None
        before, positions = self.steps[-2] if len(self.steps) > 1 else (0.0, origin)
        return Bend(share / (done - before), self.positions - positions)

    def load_step(self, goal: LoadState, bend: Bend | None = None) -> NewtonEnd:
        """Equilibrium at the goal; tools, loads and anchors are put back where it is not reached."""
        body = self.body
        memory, start = body.memory(), body.loading
        moved = self.newton.advance(self.positions, goal)
        if moved is None:
            end = NewtonEnd(self.positions, Status.STAGNATED, 0, float("nan"))
        else:
            bent = None if bend is None else bend.bent(self.positions, moved)
            start_at = bent if bent is not None and body.is_possible(bent) else self._uninverted(moved)
            if start_at is None:
                end = NewtonEnd(self.positions, Status.INVERTED, 0, float("nan"))
            else:
                end = self.equilibrium(start_at)
        if end.status is not Status.CONVERGED:
            body.recall(memory)
            body.loading = start
        return end

    def follow(self, goal: LoadState, predicted: FloatArray, reach: float) -> NewtonEnd:
        """Equilibrium at the goal near predicted positions (n, 3); in load steps from here where none is near those."""
        body = self.body
        memory, start = body.memory(), body.loading
        if body.is_possible(predicted):
            body.loading = goal
            end = self.equilibrium(predicted)
            if end.status is Status.CONVERGED:
                self.accept(reach, end)
                return end
            body.recall(memory)
            body.loading = start
        return self.ramp(goal)

    def settle(self, goal: LoadState, positions: FloatArray) -> NewtonEnd:
        """Rough equilibrium at the goal near some positions (n, 3), from which the path then goes on."""
        self.body.loading = goal
        end = self.equilibrium(positions, exact=False)
        if end.status is Status.CONVERGED:
            self.positions = end.positions
            self.body.accept(end.positions)
        return end

    def _flow(self, goal: LoadState) -> NewtonEnd | None:
        """Equilibrium at the goal that is not near, as after a slip or a snap: the organ flows there.

        A drag as of a thick fluid makes every step small, anchors of friction follow, and the drag fades as the
        organ comes to rest; the end is an equilibrium without it. None where the tools would begin deep inside the
        organ, which then would flow out of them and not along.
        """
        body = self.body
        memory, start, before = body.memory(), body.loading, self.positions
        guess = self._clear_of_tools(goal)
        if guess is None:
            body.recall(memory)
            body.loading = start
            return None
        balance = body.balance(before, body.touches(before))
        volumes = lumped_volumes(body.elasticity.rest, body.elasticity.mesh)
        rate = highest = balance.scale / (_FLOW_MM * float(volumes.sum()))
        iterations = 0
        for number in range(_FLOW_STEPS):
            self.progress(None, f"the organ flows to another equilibrium, step {number + 1}")
            body.drag = Drag(rate * volumes, self.positions)
            end = self.equilibrium(guess, exact=False)
            iterations += end.iterations
            dragging = float(np.linalg.norm(body.drag.forces(end.positions)[~body.fixed]))
            body.drag = None
            if end.status is Status.CONVERGED:
                guess = self.positions = end.positions
                body.accept(end.positions)
                if dragging < _ROUGH_TOLERANCE * balance.scale:
                    end = self.equilibrium(end.positions)
                    iterations += end.iterations
                    if end.status is Status.CONVERGED:
                        return replace(end, iterations=iterations)
                rate *= 0.25 if end.iterations <= _EASY else 0.5
            elif rate < _THICKEST * highest:
                rate *= 4.0
            else:
                break
        self.positions, body.loading = before, start
        body.recall(memory)
        return replace(end, positions=before, status=Status.ITERATION_LIMIT, iterations=iterations)

    def _clear_of_tools(self, goal: LoadState) -> FloatArray | None:
        """The first-order answer at the goal, or where the organ is; None where tools at the goal cut deep into both.

        The goal's loads become the body's in any case.
        """
        moved = self.newton.advance(self.positions, goal)
        self.body.loading = goal
        for guess in (None if moved is None else self._uninverted(moved), self.positions):
            if guess is not None and not self._penetrated(guess, -_DEEP):
                return guess
        return None

    def _uninverted(self, moved: FloatArray) -> FloatArray | None:
        """As much of a first-order answer as inverts no element and cuts no surface; what is carried goes all its way.

        None where even that does not go.
        """
        carried = np.where(self.body.fixed, moved - self.positions, 0.0)
        start, step, share = self.positions + carried, moved - self.positions - carried, 1.0
        while share > _SMALLEST_ANSWER:
            if self.body.is_possible(start + share * step):
                return start + share * step
            share /= 2.0
        return start if self.body.is_possible(start) else None

    def _penetrated(self, positions: FloatArray, margin: float) -> list[ToolContact]:
        """Tools, other than yielding ones, inside which a surface point lies, or within that share of the cushion."""
        points = self.body.surface.positions(positions)
        hard = [contact for contact in self.body.contacts if not contact.tool.yields]
        return [c for c in hard if float(c.gaps(points).min()) <= margin * c.cushion.range_mm]

    def accept(self, reach: float, end: NewtonEnd) -> None:
        """Go on from an equilibrium, at a share of the way; friction remembers it."""
        body = self.body
        self.positions = end.positions
        body.accept(end.positions)
        self.note(reach, end)
        self.steps.append((reach, end.positions))
        for contact, touch in zip(body.contacts, body.touches(end.positions, update_friction=False), strict=True):
            name = contact.tool.name
            bears = float(touch.pressures @ body.surface.areas[touch.points]) > _BEARS_MN
            if contact.tool.moves and name in self.history.bearing and not bears:
                self.history.bearing.discard(name)
                at = degrees(contact.angle) if isinstance(contact.tool, LeverTool) else None
                self.history.events.append(Event("lost_contact", name, at))
            if bears:
                self.history.met.add(name)
                self.history.bearing.add(name)

    def note(self, reach: float, end: NewtonEnd) -> None:
        """Let the record tell of a load step."""
        energy = self.body.energy(end.positions)
        self.history.record.append(
            LoadStep(self.history.stage, reach, end.iterations, end.residual, energy, end.status)
        )
