"""The computation of the study: one member's lift as a whole and by its region of interest."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.protocols import Solver
from glisson.core.scenario import Scenario
from glisson.core.structures import Tumour
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.location import PointLocator
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.mechanics.region_of_interest import RegionOfInterest, RegionOfInterestParameters
from glisson.phantom.family import build_anatomy, scanned_structures
from glisson.phantom.lever_lift import lever_lift
from glisson.phantom.proportions import draw_proportions
from glisson.studies.lifts import LIFT_PACKAGES, carried_centroid, lift_model
from glisson.studies.meshing import member_surface, mesh_of_size
from glisson.studies.point import Outcome, Task

COMPARE = Task(
    f"{__name__}:compare_lift", (*LIFT_PACKAGES, "glisson.studies.lifts", "glisson.studies.meshing", __name__)
)

_LIVER = Material("neo-hookean", 7.0, 0.45)


def compare_lift(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Seconds of both, and for each tumour how far apart they put its centroid beside what was estimated (mm)."""
    proportions = draw_proportions(inputs["member"])
    mesh, _ = mesh_of_size(member_surface(proportions), inputs["elements"])
    tumours = scanned_structures(build_anatomy(inputs["member"]).interior, None).tumours
    model, scenario = lift_model(_with_tumours(mesh, tumours), _LIVER), lever_lift(proportions)
    values: dict[str, Any] = {"elements": len(mesh.tetrahedra)}
    whole, values["whole_seconds"] = _timed(QuasiStatic(QuasiStaticParameters()), model, scenario)
    region, values["region_seconds"] = _timed(RegionOfInterest(RegionOfInterestParameters()), model, scenario)
    for found in (whole, region):
        if not found.status.is_good:
            return Outcome(values, {}, found.status, found.message)
    return Outcome(values | {"tumours": [_compared(whole, region, tumour) for tumour in tumours]})


def _with_tumours(mesh: TetMesh, tumours: Sequence[Tumour]) -> TetMesh:
    """The mesh with a region for each tumour: the elements with their middles in it."""
    middles = mesh.nodes[mesh.tetrahedra].mean(axis=1)
    regions = np.zeros(len(middles), dtype=np.int64)
    for count, tumour in enumerate(tumours, start=1):
        regions[SurfaceTree(tumour.surface.vertices, tumour.surface.triangles).contains(middles)] = count
    return TetMesh(mesh.nodes, mesh.tetrahedra, regions)


def _timed(solver: Solver, model: Model, scenario: Scenario) -> tuple[Deformation, float]:
    started = perf_counter()
    found = solver.solve(model, scenario)
    return found, perf_counter() - started


def _compared(whole: Deformation, region: Deformation, tumour: Tumour) -> dict[str, Any]:
    first, second = carried_centroid(whole, tumour), carried_centroid(region, tumour)
    return {
        "moved_mm": float(np.linalg.norm(first - tumour.centroid_mm)),
        "apart_mm": float(np.linalg.norm(first - second)),
        "estimated_mm": _estimated_mm(region, tumour),
    }


def _estimated_mm(deformation: Deformation, tumour: Tumour) -> float | None:
    """Mean of the estimated error on the tumour's surface; None where the whole organ was solved."""
    error = deformation.estimated_error
    if error is None:
        return None
    locator = PointLocator(deformation.mesh)
    field = np.repeat(error[:, None], 3, axis=1)
    return float(locator.interpolate(locator.locate(tumour.surface.vertices), field)[:, 0].mean())
