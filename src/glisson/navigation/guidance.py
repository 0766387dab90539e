"""Navigation: from a deformation (and, where known, the truth) to what the surgeon is told."""

from collections.abc import Sequence

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.errors import BadInput
from glisson.core.guidance import (
    CrossedVessel,
    Guidance,
    PlaneGuidance,
    TumourGuidance,
    VolumeGuidance,
    WireGuidance,
)
from glisson.core.model import Model
from glisson.core.status import Status
from glisson.core.structures import Plane
from glisson.core.units import millilitres_from_mm3
from glisson.geometry.distance import closest_points
from glisson.geometry.planes import angle_between_deg
from glisson.navigation.plan import Plan
from glisson.navigation.survey import PlanInA, Survey, read_plan, survey
from glisson.navigation.vessels import crossed_vessels


def navigate(
    model: Model, deformation: Deformation, plan: Plan, truth: Deformation | None = None, warnings: Sequence[str] = ()
) -> Guidance:
    """Everything that is told of a deformation of the model's scanned shape A.

    `truth` is another deformation of the same A, on a mesh of its own; where it is given (and converged)
    tumours and planes carry their errors: of centroids in mm, of normals in degrees, of the planes' offset
    at the true tumour centroid along the true normal in mm, of the removed part in percentage points
    (all without sign). The guidance carries the deformation's status: unless it is good, the numbers come
    from an unfinished last stage and must not be used. `warnings`, sentences on what the model was made of, come
    first among its notes.

    Raises:
        BadInput: the plan names a tumour that the model does not have, or its plane misses the liver.
    """
    in_a = read_plan(model.structures, plan)
    notes = [*warnings, *in_a.notes]
    if not deformation.stages:
        notes.append("The solve ended before its first stage did, so nothing is known of the deformed liver.")
        return _nothing(deformation.status, in_a, notes)
    found = survey(deformation, model.structures, plan, in_a)
    if plan.plane is not None and found.carried is None:
        raise BadInput("The planned resection plane does not cut the liver; correct its three points (LPS, mm).")
    true = None
    if truth is not None and truth.status is Status.CONVERGED:
        true = survey(truth, model.structures, plan, in_a)
    elif truth is not None:
        notes.append("The truth did not converge, so no errors are given.")
    centre = None if true is None or in_a.target is None else true.tumour(in_a.target.name).centroid_mm
    carried, rule = _carried_guidance(in_a, found, true, centre), _rule_guidance(in_a, found, true, centre)
    crossed: tuple[CrossedVessel, ...] = ()
    if found.carried is not None:
        crossed = crossed_vessels(model.structures.trees, found.carried.plane, found.point_map)
    return Guidance(
        status=deformation.status,
        tumours=_tumours(model, found, true),
        target=None if in_a.target is None else in_a.target.name,
        carried=carried,
        rule=rule,
        volume=_volume(found),
        wire=_wire(in_a, found),
        margin_mm=_margin_mm(in_a, found),
        crossed=crossed,
        notes=(*notes, *found.notes),
    )


def _nothing(status: Status, in_a: PlanInA, notes: list[str]) -> Guidance:
    target = None if in_a.target is None else in_a.target.name
    return Guidance(status, (), target, None, None, None, None, None, notes=tuple(notes))


def _tumours(model: Model, found: Survey, true: Survey | None) -> tuple[TumourGuidance, ...]:
    told = []
    for before, after in zip(model.structures.tumours, found.tumours, strict=True):
        error = None
        if true is not None:
            error = float(np.linalg.norm(after.centroid_mm - true.tumour(after.name).centroid_mm))
        told.append(TumourGuidance(after.name, before.centroid_mm, after.centroid_mm, error_mm=error))
    return tuple(told)


def _carried_guidance(
    in_a: PlanInA, found: Survey, true: Survey | None, centre: FloatArray | None
) -> PlaneGuidance | None:
    if in_a.plane is None or found.carried is None:
        return None
    truth = None if true is None or true.carried is None else true.carried.plane
    errors = plane_errors(found.carried.plane, truth, centre)
    points = _points(found.removed_by_carried, None if true is None else true.removed_by_carried)
    angle = angle_between_deg(in_a.plane, found.carried.plane)
    return PlaneGuidance(in_a.plane, found.carried.plane, angle, found.carried.residual_mm, *errors, points)


def _rule_guidance(
    in_a: PlanInA, found: Survey, true: Survey | None, centre: FloatArray | None
) -> PlaneGuidance | None:
    if in_a.plane is None or found.rule is None:
        return None
    errors = plane_errors(found.rule, None if true is None else true.rule, centre)
    points = _points(found.removed_by_rule, None if true is None else true.removed_by_rule)
    return PlaneGuidance(in_a.plane, found.rule, angle_between_deg(in_a.plane, found.rule), 0.0, *errors, points)


def plane_errors(found: Plane, true: Plane | None, centre: FloatArray | None) -> tuple[float | None, float | None]:
    """Angle in degrees between the normals, and offset in mm along the true normal through `centre` (3,).

    The offset is None where the found plane does not cut that line on the right side (90° and more apart).
    """
    if true is None:
        return None, None
    slope = float(found.normal @ true.normal)
    offset = None
    if centre is not None and slope > 1e-6:
        offset = abs(float(found.distance_mm(centre[None])[0]) / slope - float(true.distance_mm(centre[None])[0]))
    return angle_between_deg(found, true), offset


def _points(found: float | None, true: float | None) -> float | None:
    return None if found is None or true is None else 100.0 * abs(found - true)


def _volume(found: Survey) -> VolumeGuidance | None:
    after = found.removed_by_carried if found.removed_by_rule is None else found.removed_by_rule
    if found.removed_before is None or after is None:
        return None
    return VolumeGuidance(millilitres_from_mm3(found.organ_before_mm3), found.removed_before, after)


def _wire(in_a: PlanInA, found: Survey) -> WireGuidance | None:
    """Slide (positive inward) and the distance from the wire's tip to the target's surface, both in B."""
    if found.wire is None or found.slide_mm is None or in_a.target is None:
        return None
    tip = found.wire.at(found.wire.length_mm)
    distance, _ = closest_points(tip, found.tumour(in_a.target.name).surface)
    return WireGuidance(found.slide_mm, float(distance[0]))


def _margin_mm(in_a: PlanInA, found: Survey) -> float | None:
    """Least distance of the target's surface from the carried plane in B; negative where the plane cuts it."""
    if in_a.target is None or found.carried is None:
        return None
    return float(found.carried.plane.distance_mm(found.tumour(in_a.target.name).surface.vertices).min())
