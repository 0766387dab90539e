"""A technique on a lift: how far tumour, plane, removed part and surface are off, and what doing less leaves."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.model import Model
from glisson.core.registered import Registered
from glisson.geometry.location import PointLocator
from glisson.geometry.mapping import PointMap
from glisson.geometry.spreading import evenly_spread
from glisson.navigation.guidance import navigate
from glisson.navigation.plan import Plan
from glisson.studies.lever_lift.observing import observe
from glisson.studies.lever_lift.planning import planned, read_plan, technique_of
from glisson.studies.lever_lift.truths import PACKAGES, case_of, read_truth, structures_of
from glisson.studies.lifts import carried_centroid, rigidly_moved
from glisson.studies.point import Outcome, Point, Task

SCORE = Task(
    f"{__name__}:score_case",
    (
        *PACKAGES, "glisson.mechanics", "glisson.navigation", "glisson.preoperative", "glisson.studies.lifts",
        "glisson.studies.lever_lift",
    ),
)  # fmt: skip

TARGET = "tumour1"
_SURFACE_POINTS = 400


def score_point(plan: Point, truth: Point) -> Point:
    """The point that registers a planned case to what was seen of its truth."""
    return Point(SCORE, {**plan.inputs, "plan": plan.key, "truth": truth.key}, cost=3.0)


def score_case(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Observe a lift, register the model to it, and compare with the truth."""
    case, truth = case_of(inputs), read_truth(folder, inputs["truth"])
    structures = structures_of(case)
    model, tangent = read_plan(folder, inputs["plan"], structures)
    prepared = technique_of(inputs).with_tangent(model, planned(case), tangent)
    found = prepared.register(observe(case, truth, structures))
    return Outcome(scores(found, model, truth), {}, found.status, found.deformation.message)


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
