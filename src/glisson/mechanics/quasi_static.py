"""The solver technique: rest shape, then stage after stage in load steps, each an equilibrium or a status."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from glisson.core.deformation import Deformation
from glisson.core.errors import StageFailed
from glisson.core.mesh import TET_EDGES
from glisson.core.model import Model
from glisson.core.parameters import parameter
from glisson.core.protocols import Progress, silent
from glisson.core.scenario import Scenario
from glisson.core.tools import Board
from glisson.mechanics.body import Body
from glisson.mechanics.contact import ToolContact
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.elastic_attachments import ElasticAttachments
from glisson.mechanics.elasticity import Elasticity
from glisson.mechanics.elements import SurfaceQuadrature, surface_quadrature
from glisson.mechanics.gas_pressure import GasPressure
from glisson.mechanics.initial_gaps import settle_gaps
from glisson.mechanics.linear_solvers import make_iterative_solver
from glisson.mechanics.membrane import Membrane
from glisson.mechanics.newton import Newton, NewtonSettings
from glisson.mechanics.numbering import numbering
from glisson.mechanics.parts import Part
from glisson.mechanics.rest_shape import RestShape, find_rest_shape
from glisson.mechanics.sampling import face_parts
from glisson.mechanics.self_contact import SelfContact
from glisson.mechanics.sliding_rod import SlidingRod
from glisson.mechanics.stages import StageRunner, fixed_unknowns, gravity_forces
from glisson.mechanics.ties import Ties
from glisson.mechanics.tools import make_tool

_CUSHION_STIFFNESS_KPA = 36.0  # over the range; see `Cushion`
_CUSHION_STIFFNESS_MODULI = 1.8
_BEDDING = Cushion(range_mm=2.0, stiffness_kpa_mm=1.0, hardening=0.0)
"""Neighbouring tissue: an organ's weight (0.5 kPa) sinks in by 1.4 mm, as into some centimetres of it."""


@dataclass(frozen=True)
class QuasiStaticParameters:
    """How exactly and in which steps the quasi-static solver works."""

    element: str = parameter(
        "T10", "element: T10 (quadratic) or T4 (locks near incompressibility)", choices=("T4", "T10")
    )
    tolerance: float = parameter(1e-6, "residual over the largest force at which a step has converged", 1e-12, 1e-3)
    step_deg: float = parameter(8.0, "largest turn of a lever in one load step, in degrees", 0.05, 15.0)
    contact_range_mm: float = parameter(0.1, "gap in mm at which a tool begins to press", 1e-3, 2.0)
    stick_mm: float = parameter(0.2, "elastic slip in mm before friction gives way", 1e-4, 1.0)
    surface_tolerance_mm: float = parameter(
        2.0, "how far in mm the scanned surface may lie from a tool and still be taken as touching it", 0.0, 10.0
    )
    self_contact: bool = parameter(False, "whether parts of the organ's surface keep each other off (needs ipctk)")
    iteration_limit: int = parameter(25, "Newton iterations allowed in one load step", 1, 10_000)


class QuasiStatic:
    """Finite elements with frictional contact by Newton's method (design, section 3)."""

    name: ClassVar[str] = "quasi-static"
    summary: ClassVar[str] = "hyperelastic finite elements with frictional contact, in load steps"
    Parameters: ClassVar[type[QuasiStaticParameters]] = QuasiStaticParameters

    def __init__(self, parameters: QuasiStaticParameters) -> None:
        self._parameters = parameters

    @classmethod
    def missing_dependencies(cls) -> tuple[str, ...]:
        """Nothing beyond Glisson's own dependencies; MKL makes it faster."""
        return ()

    def solve(self, model: Model, scenario: Scenario, progress: Progress = silent) -> Deformation:
        """Deformation through all stages; the mesh of the answer is T10 unless `element` is T4.

        Raises:
            BadInput: the model lacks a named node set, or a tool cuts deep into the organ at the start.
        """
        if self._parameters.element == "T10":
            model = _quadratic(model)
        order = numbering(model.mesh.nodes)
        return order.deformation(self._solve(order.model(model), scenario, progress), model.mesh)

    def _solve(self, model: Model, scenario: Scenario, progress: Progress) -> Deformation:
        try:
            progress(0.0, "finding the unloaded shape")
            body = self._body(model, scenario)
        except StageFailed as failure:
            return Deformation(model.mesh, (), failure.status, str(failure))
        settings = NewtonSettings(self._parameters.tolerance, self._parameters.iteration_limit)
        newton = Newton(body, make_iterative_solver(), settings)
        try:
            return StageRunner(model, scenario, body, newton, self._parameters.step_deg, progress).run()
        finally:
            newton.close()

    def _body(self, model: Model, scenario: Scenario) -> Body:
        """The body in equilibrium at A, its tools' gaps settled."""
        parameters = self._parameters
        mesh = model.mesh
        tools = [make_tool(tool, scenario.stages) for tool in scenario.tools]
        surface = surface_quadrature(mesh.nodes, mesh, face_parts(mesh, tools, scenario.stages))
        rod = _rod(model)
        rest = self._rest_shape(model, scenario, surface, rod)
        stiffest = max(material.young_modulus_kpa for material in model.materials.values())
        slope = max(_CUSHION_STIFFNESS_KPA, _CUSHION_STIFFNESS_MODULI * stiffest) / parameters.contact_range_mm
        cushion = Cushion(parameters.contact_range_mm, slope)
        contacts = [
            ToolContact(tool, surface, _BEDDING if tool.yields else cushion, parameters.stick_mm) for tool in tools
        ]
        settle_gaps(contacts, surface.positions(mesh.nodes), rest.supports, parameters.surface_tolerance_mm)
        elasticity = Elasticity(mesh, model.materials, rest.positions)
        fixed = fixed_unknowns(model, scenario.stages[0].fixed)
        ligaments = [ElasticAttachments(model)] if model.ligaments else []
        gas = GasPressure(mesh) if any(stage.gas_pressure_kpa for stage in scenario.stages) else None
        parts: list[Part] = [] if model.capsule is None else [Membrane(mesh, model.capsule)]
        parts += ligaments
        parts += [] if rod is None else [rod]
        parts += [Ties(model, model.ties)] if model.ties else []
        if parameters.self_contact:
            parts.append(SelfContact(mesh, parameters.contact_range_mm, stiffest))
        body = Body(elasticity, surface, contacts, fixed, parts, gas)
        if scenario.rest_shape == "from-gravity":
            body.external = gravity_forces(model, scenario.scan_gravity)
            for part in ligaments:
                part.settle(body.balance(mesh.nodes, body.touches(mesh.nodes, update_friction=False)).unbalanced)
        return body

    def _rest_shape(
        self, model: Model, scenario: Scenario, surface: SurfaceQuadrature, rod: SlidingRod | None
    ) -> RestShape:
        if scenario.rest_shape == "as-scanned" or (scenario.scan_gravity is None and rod is None):
            return RestShape(model.mesh.nodes, {})
        loads = gravity_forces(model, scenario.scan_gravity)
        if rod is not None:
            loads += rod.forces(model.mesh.nodes)
        supports = [t for t in scenario.tools if isinstance(t, Board) and t.name in scenario.scan_supports]
        return find_rest_shape(
            model.mesh,
            model.materials,
            loads,
            supports,
            surface,
            fixed_unknowns(model, (*scenario.stages[0].fixed, *model.ligaments)),
            self._parameters.surface_tolerance_mm,
        )


def _rod(model: Model) -> SlidingRod | None:
    """The rod in the model's duct; None where there is none."""
    structures = model.structures
    if model.rod is None or structures.duct is None or structures.wire_length_mm is None:
        return None
    return SlidingRod(model.mesh, structures.duct, structures.wire_length_mm, model.rod)


def _quadratic(model: Model) -> Model:
    """The model with T10 elements; a middle node belongs to a node set when both its ends do."""
    mesh = model.mesh.as_quadratic()
    if mesh is model.mesh:
        return model
    ends = mesh.corners[:, TET_EDGES].reshape(-1, 2)
    middles = mesh.tetrahedra[:, 4:].ravel()
    sets = {}
    for name, nodes in model.node_sets.items():
        inside = np.zeros(len(mesh.nodes), dtype=bool)
        inside[nodes] = True
        inside[middles[inside[ends].all(axis=1)]] = True
        sets[name] = np.flatnonzero(inside)
    return replace(model, mesh=mesh, node_sets=sets)
