"""A technique on a lift: how far tumour, plane, removed part and surface are off, and what doing less leaves."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.model import Material, Model
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.core.structures import Structures
from glisson.geometry.location import PointLocator
from glisson.geometry.mapping import PointMap
from glisson.geometry.quadratic import boundary_surface
from glisson.geometry.spreading import evenly_spread
from glisson.navigation.guidance import navigate
from glisson.navigation.plan import Plan
from glisson.phantom.lift_truths import lift_truth
from glisson.phantom.proportions import draw_proportions
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.studies.lever_lift.cases import LeverCase, planned_scenario
from glisson.studies.lever_lift.observing import observe
from glisson.studies.lever_lift.truths import PACKAGES, case_of, read_truth, structures_of
from glisson.studies.lifts import carried_centroid, lift_model, rigidly_moved
from glisson.studies.meshing import member_surface
from glisson.studies.point import Outcome, Point, Task

SCORE = Task(
    f"{__name__}:score_case",
    (
        *PACKAGES, "glisson.mechanics", "glisson.navigation", "glisson.preoperative", "glisson.studies.lifts",
        "glisson.studies.lever_lift",
    ),
)  # fmt: skip

TISSUE, FRICTION = Material("neo-hookean", 7.0, 0.45), 0.2
"""What a user who has measured nothing would take."""

TARGET = "tumour1"
_SURFACE_POINTS = 400


def score_point(truth: Point, parameters: Mapping[str, Any], edge_mm: float, envelope_mm: float) -> Point:
    """The point that registers the case of a truth's point."""
    inputs = {
        "case": truth.inputs["case"],
        "truth": truth.key,
        "parameters": dict(parameters),
        "edge_mm": edge_mm,
        "envelope_mm": envelope_mm,
    }
    return Point(SCORE, inputs, cost=15.0)


def score_case(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Observe a lift, register the model to it, and compare with the truth."""
    case, truth = case_of(inputs), read_truth(folder, inputs["truth"])
    structures = structures_of(case)
    model = model_of(case, structures, inputs["edge_mm"], inputs["envelope_mm"])
    technique = make_technique("registration", "scenario", inputs["parameters"], "scenario")
    prepared = technique.prepare(model, planned_scenario(case, FRICTION))
    found: Registered = prepared.register(observe(case, truth, structures))
    values = scores(found, model, truth)
    return Outcome(values, {}, found.status, found.deformation.message)


def model_of(case: LeverCase, structures: Structures, edge_mm: float, envelope_mm: float) -> Model:
    """The model that a user would have of a liver: its scanned surface, coarse, of one tissue throughout."""
    if case.calculix is None:
        surface = member_surface(draw_proportions(case.member))
    else:
        surface = boundary_surface(lift_truth(case.calculix).read().deformation.mesh)
    mesh = Mmg(MmgParameters(edge_length_mm=edge_mm, envelope_mm=envelope_mm)).mesh(surface)
    return replace(lift_model(mesh, TISSUE), structures=structures)


def scores(found: Registered, model: Model, truth: Deformation) -> dict[str, Any]:
    """How far a registration is off."""
    guidance = navigate(model, found.deformation, Plan(TARGET), truth)
    told = next(tumour for tumour in guidance.tumours if tumour.name == TARGET)
    target = next(tumour for tumour in model.structures.tumours if tumour.name == TARGET)
    before, after = target.centroid_mm, carried_centroid(truth, target)
    plane = guidance.rule
    return {
        "elements": len(model.mesh.tetrahedra),
        "tumour_mm": told.error_mm,
        "plane_deg": None if plane is None else plane.error_deg,
        "removed_points": None if plane is None else plane.error_points,
        "surface_errors_mm": [round(float(error), 4) for error in _surface_errors(found, truth)],
        "covered90": _covered(found, before, after),
        "radius90_mm": _radius90(found, before),
        "rigid_mm": float(np.linalg.norm(after - rigidly_moved(truth, before))),
        "uncorrected_mm": float(np.linalg.norm(after - before)),
        "notes": list(found.notes),
    }


def _surface_errors(found: Registered, truth: Deformation) -> FloatArray:
    """Of material points all over the surface, the hidden part too, in mm."""
    nodes = np.unique(truth.mesh.boundary()[0])
    nodes = nodes[evenly_spread(truth.mesh.nodes[nodes], _SURFACE_POINTS)]
    places = PointMap(found.deformation.mesh, found.deformation.displacement).forward(truth.mesh.nodes[nodes])
    errors: FloatArray = np.linalg.norm(places - truth.mesh.moved(truth.displacement)[nodes], axis=1)
    return errors


def _covered(found: Registered, before: FloatArray, after: FloatArray) -> bool:
    """Whether the region that should hold the tumour's centroid by 90 % does."""
    place, covariance = _told(found, before)
    off = after - place
    return bool(off @ np.linalg.solve(covariance, off) <= chi2.ppf(0.9, 3))


def _radius90(found: Registered, before: FloatArray) -> float:
    _, covariance = _told(found, before)
    return float(np.sqrt(chi2.ppf(0.9, 3) * np.linalg.eigvalsh(covariance)[-1]))


def _told(found: Registered, point: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where a point (3,) of A is by the registration, and its covariance (3, 3)."""
    mesh = found.deformation.mesh
    locator = PointLocator(mesh)
    location = locator.locate(point[None])
    place = locator.interpolate(location, found.positions_mm)[0]
    return place, found.covariance(mesh.tetrahedra[location.elements], locator.weights(location))[0]
