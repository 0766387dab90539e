"""Guidance for machines: one JSON-ready dictionary (design, section 5)."""

from collections.abc import Mapping
from typing import Any

from glisson.core.deformation import Deformation
from glisson.core.guidance import Guidance, PlaneGuidance, TumourGuidance
from glisson.core.structures import Plane
from glisson.core.units import millilitres_from_mm3


def as_results(guidance: Guidance, deformation: Deformation, seconds: Mapping[str, float]) -> dict[str, Any]:
    """The keys of `results.json`; what is not known is None, never invented.

    Lengths in mm (LPS points as lists of three), angles in degrees, volumes in ml, removed parts as
    fractions. `seconds` maps stages to their time, 0 for those that were skipped.
    """
    tumours = [_tumour(tumour) for tumour in guidance.tumours]
    volume, wire = guidance.volume, guidance.wire
    return {
        "status": str(guidance.status),
        "message": deformation.message,
        "events": [{"kind": e.kind, "tool": e.tool, "at_deg": e.at_deg} for e in deformation.events],
        "tumours": tumours,
        "tumour": next((tumour for tumour in tumours if tumour["name"] == guidance.target), None),
        "plane": {"carried": _plane(guidance.carried), "rule": _plane(guidance.rule)},
        "volume": {
            "liver_ml": millilitres_from_mm3(deformation.mesh.volume_mm3) if volume is None else volume.liver_ml,
            "removed_before": None if volume is None else volume.removed_before,
            "removed_after": None if volume is None else volume.removed_after,
        },
        "wire": None if wire is None else {"slide_mm": wire.slide_mm, "distance_mm": wire.distance_mm},
        "margin_mm": guidance.margin_mm,
        "crossed": [
            {"tree": v.tree, "diameter_mm": v.diameter_mm, "point_mm": list(v.point_mm)} for v in guidance.crossed
        ],
        "elements": len(deformation.mesh.tetrahedra),
        "seconds": {stage: float(duration) for stage, duration in seconds.items()},
        "notes": list(guidance.notes),
    }


def _tumour(tumour: TumourGuidance) -> dict[str, Any]:
    return {
        "name": tumour.name,
        "before_mm": tumour.before_mm.tolist(),
        "after_mm": tumour.after_mm.tolist(),
        "radius95_mm": tumour.radius95_mm,
        "error_mm": tumour.error_mm,
    }


def _plane(plane: PlaneGuidance | None) -> dict[str, Any] | None:
    if plane is None:
        return None
    return {
        "angle_deg": plane.angle_deg,
        "residual_mm": plane.residual_mm,
        "error_deg": plane.error_deg,
        "error_mm": plane.error_mm,
        "error_points": plane.error_points,
        "before": _geometry(plane.before),
        "after": _geometry(plane.after),
    }


def _geometry(plane: Plane) -> dict[str, list[float]]:
    return {"point_mm": plane.point_mm.tolist(), "normal": plane.normal.tolist()}
