"""The body of a model in the scanned shape: unloaded shape, tools, and what else acts on it."""

from typing import Protocol

from glisson.core.model import Model
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
from glisson.mechanics.loads import fixed_unknowns, gravity_forces
from glisson.mechanics.membrane import Membrane
from glisson.mechanics.model_checks import check_model
from glisson.mechanics.parts import Part
from glisson.mechanics.rest_shape import RestShape, find_rest_shape
from glisson.mechanics.sampling import face_parts
from glisson.mechanics.self_contact import SelfContact
from glisson.mechanics.sliding_rod import SlidingRod
from glisson.mechanics.ties import Ties
from glisson.mechanics.tools import make_tool

_CUSHION_STIFFNESS_KPA = 36.0  # over the range; see `Cushion`
_CUSHION_STIFFNESS_MODULI = 1.8
_BEDDING = Cushion(range_mm=2.0, stiffness_kpa_mm=1.0, hardening=0.0)
"""Neighbouring tissue: an organ's weight (0.5 kPa) sinks in by 1.4 mm, as into some centimetres of it."""


class ContactSettings(Protocol):
    """How contact is modelled; see `QuasiStaticParameters`."""

    @property
    def contact_range_mm(self) -> float:
        """Gap at which a tool begins to press."""

    @property
    def stick_mm(self) -> float:
        """Elastic slip before friction gives way."""

    @property
    def surface_tolerance_mm(self) -> float:
        """How far the scanned surface may lie from a tool and still be taken as touching it."""

    @property
    def self_contact(self) -> bool:
        """Whether parts of the organ's surface keep each other off."""


def loaded_body(model: Model, scenario: Scenario, settings: ContactSettings, rest_accuracy: float) -> Body:
    """The body in equilibrium in the scanned shape, its tools' gaps settled.

    Raises:
        StageFailed: no unloaded shape was found to `rest_accuracy`, a residual over the weight.
        BadInput: the model lacks a named node set or means nothing (`model_checks`), or a tool cuts deep into the
            organ.
    """
    check_model(model, scenario)
    mesh = model.mesh
    tools = [make_tool(tool, scenario.stages) for tool in scenario.tools]
    surface = surface_quadrature(mesh.nodes, mesh, face_parts(mesh, tools, scenario.stages))
    rod = _rod(model)
    rest = _rest_shape(model, scenario, settings, surface, rod, rest_accuracy)
    stiffest = max(material.young_modulus_kpa for material in model.materials.values())
    slope = max(_CUSHION_STIFFNESS_KPA, _CUSHION_STIFFNESS_MODULI * stiffest) / settings.contact_range_mm
    cushion = Cushion(settings.contact_range_mm, slope)
    contacts = [ToolContact(tool, surface, _BEDDING if tool.yields else cushion, settings.stick_mm) for tool in tools]
    settle_gaps(contacts, surface.positions(mesh.nodes), rest.supports, settings.surface_tolerance_mm)
    elasticity = Elasticity(mesh, model.materials, rest.positions)
    fixed = fixed_unknowns(model, scenario.stages[0].fixed)
    ligaments = [ElasticAttachments(model)] if model.ligaments else []
    gas = GasPressure(mesh) if any(stage.gas_pressure_kpa for stage in scenario.stages) else None
    parts: list[Part] = [] if model.capsule is None else [Membrane(mesh, model.capsule)]
    parts += ligaments
    parts += [] if rod is None else [rod]
    parts += [Ties(model, model.ties)] if model.ties else []
    if settings.self_contact:
        parts.append(SelfContact(mesh, settings.contact_range_mm, stiffest))
    body = Body(elasticity, surface, contacts, fixed, parts, gas)
    if scenario.rest_shape == "from-gravity":
        body.external = gravity_forces(model, scenario.scan_gravity)
        for part in ligaments:
            part.settle(body.balance(mesh.nodes, body.touches(mesh.nodes, update_friction=False)).unbalanced)
    return body


def _rest_shape(
    model: Model,
    scenario: Scenario,
    settings: ContactSettings,
    surface: SurfaceQuadrature,
    rod: SlidingRod | None,
    accuracy: float,
) -> RestShape:
    if scenario.rest_shape == "as-scanned" or (scenario.scan_gravity is None and rod is None):
        return RestShape(model.mesh.nodes, {})
    loads = gravity_forces(model, scenario.scan_gravity)
    if rod is not None:
        loads += rod.forces(model.mesh.nodes)
    supports = [t for t in scenario.tools if isinstance(t, Board) and t.name in scenario.scan_supports]
    fixed = fixed_unknowns(model, (*scenario.stages[0].fixed, *model.ligaments))
    return find_rest_shape(
        model.mesh, model.materials, loads, supports, surface, fixed, settings.surface_tolerance_mm, accuracy
    )


def _rod(model: Model) -> SlidingRod | None:
    """The rod in the model's duct; None where there is none."""
    structures = model.structures
    if model.rod is None or structures.duct is None or structures.wire_length_mm is None:
        return None
    return SlidingRod(model.mesh, structures.duct, structures.wire_length_mm, model.rod)
