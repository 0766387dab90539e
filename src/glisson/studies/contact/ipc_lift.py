"""A manoeuvre with the tools of `IpcTools`: small steps, none of which cuts a tool, each an equilibrium."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation, StageResult
from glisson.core.mesh import TriangleSurface
from glisson.core.model import Model
from glisson.core.scenario import Scenario, Stage
from glisson.core.status import Status
from glisson.core.tools import Board, Lever, Tool
from glisson.core.units import newtons_from_millinewtons
from glisson.mechanics.body import Body
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import surface_quadrature
from glisson.mechanics.linear_solvers import make_iterative_solver
from glisson.mechanics.loads import fixed_unknowns, gravity_forces
from glisson.mechanics.newton import Newton, NewtonSettings
from glisson.mechanics.numbering import numbering
from glisson.mechanics.quadratic_model import quadratic_model
from glisson.mechanics.tools import make_tool
from glisson.studies.contact.ipc_tools import IpcTools
from glisson.studies.contact.tool_surfaces import board_surface, lever_surface

_SETTINGS = NewtonSettings(1e-4, 60)
_FIRST_WEIGHT, _LARGEST_WEIGHT = 0.05, 0.2
_FIRST_TURN, _LARGEST_TURN = radians(0.1), radians(2.0)
_SMALLEST = 1e-2  # of the first step
_EASY, _GROWTH = 20, 1.5  # iterations after which the next step grows


@dataclass(frozen=True, eq=False)
class IpcLift:
    """The deformation, and the force (3,) in N of the organ on each tool at its end."""

    deformation: Deformation
    forces_n: tuple[FloatArray, ...]


def lift_by_ipc(model: Model, scenario: Scenario) -> IpcLift:
    """Solve a scenario of boards and levers that begins as scanned, clear of the tools, without cohesion."""
    quadratic = quadratic_model(model)
    order = numbering(quadratic.mesh.nodes)
    driver = _Driver(order.model(quadratic), scenario)
    try:
        deformation, forces = driver.run()
    finally:
        driver.newton.close()
    return IpcLift(order.deformation(deformation, quadratic.mesh), forces)


class _Driver:
    def __init__(self, model: Model, scenario: Scenario) -> None:
        mesh = model.mesh
        self._model, self._scenario = model, scenario
        self._part = IpcTools(
            mesh,
            [make_tool(tool) for tool in scenario.tools],
            [_surface(tool) for tool in scenario.tools],
            max(material.young_modulus_kpa for material in model.materials.values()),
        )
        fixed = fixed_unknowns(model, scenario.stages[0].fixed)
        surface = surface_quadrature(mesh.nodes, mesh, 1)
        self._body = Body(Elasticity(mesh, model.materials, mesh.nodes), surface, (), fixed, [self._part])
        self.newton = Newton(self._body, make_iterative_solver(), _SETTINGS)
        self._positions = np.array(mesh.nodes)

    def run(self) -> tuple[Deformation, tuple[FloatArray, ...]]:
        """All stages; the first one also brings on the weight."""
        results: list[StageResult] = []
        status = Status.CONVERGED
        for number, stage in enumerate(self._scenario.stages):
            self._part.friction = stage.contact.friction
            status = self._settle() if number == 0 else Status.CONVERGED
            if status is Status.CONVERGED:
                status = self._lift(stage)
            results.append(StageResult(stage.name, self._positions - self._model.mesh.nodes, status))
            if status is not Status.CONVERGED:
                break
        tools = range(len(self._scenario.tools))
        forces = tuple(newtons_from_millinewtons(1.0) * self._part.on_tool(n, self._positions) for n in tools)
        return Deformation(self._model.mesh, tuple(results), status, status.sentence), forces

    def _settle(self) -> Status:
        """Bring on the weight."""
        weight = gravity_forces(self._model, self._scenario.surgery_gravity)

        def load(share: float) -> None:
            self._body.external = share * weight

        return self._go(load, _FIRST_WEIGHT, _LARGEST_WEIGHT)

    def _lift(self, stage: Stage) -> Status:
        """Turn the levers."""
        start, goals = list(self._part.angles), list(self._part.angles)
        names = [tool.name for tool in self._scenario.tools]
        for drive in stage.drives:
            assert drive.angle_deg is not None  # the study's lifts have angles
            goals[names.index(drive.lever)] = radians(drive.angle_deg)
        way = max((abs(goal - angle) for goal, angle in zip(goals, start, strict=True)), default=0.0)
        if way == 0.0:
            return Status.CONVERGED

        def turn(share: float) -> None:
            self._part.angles = [a + share * (b - a) for a, b in zip(start, goals, strict=True)]

        return self._go(turn, _FIRST_TURN / way, _LARGEST_TURN / way)

    def _go(self, put: Callable[[float], None], first: float, largest: float) -> Status:
        """From 0 to 1 in steps that adapt; the organ is expected to go on moving as it did in the step before."""
        done, share = 0.0, first
        velocity = np.zeros_like(self._positions)
        while done < 1.0:
            step = min(share, 1.0 - done)
            memory, before = self._part.memory(), self._positions
            put(done + step)
            status, iterations = self._equilibrium_near((before + step * velocity, before))
            if status is Status.CONVERGED:
                velocity, done = (self._positions - before) / step, min(done + step, 1.0)
                if iterations < _EASY:
                    share = min(_GROWTH * share, largest)
                continue
            self._part.recall(memory)
            share = step / 2.0
            if share < _SMALLEST * first:
                return status
        return Status.CONVERGED

    def _equilibrium_near(self, guesses: Sequence[FloatArray]) -> tuple[Status, int]:
        """From the first guess that cuts nothing."""
        for guess in guesses:
            if np.isfinite(self._body.energy(guess)):
                return self._equilibrium(guess)
        return Status.STAGNATED, 0

    def _equilibrium(self, guess: FloatArray) -> tuple[Status, int]:
        end = self.newton.solve(guess)
        if end.status is Status.CONVERGED:
            self._positions = end.positions
            self._body.accept(end.positions)
        return end.status, end.iterations


def _surface(tool: Tool) -> TriangleSurface:
    if isinstance(tool, Board):
        return board_surface(tool)
    assert isinstance(tool, Lever)  # the study's scenarios have no others
    return lever_surface(tool, 0.0)[0]
