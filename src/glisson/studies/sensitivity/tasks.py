"""The computations of the study: a mesh, a truth, a model's lift. They run in workers.

All of them look at one liver: a member of the phantom family in the loaded shape A that CalculiX found.
"""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.core.model import Material, Model
from glisson.core.structures import Tumour
from glisson.geometry.quadratic import boundary_surface
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.phantom.family import build_anatomy, scanned_structures
from glisson.phantom.heterogeneity import stiffness_levels, uneven_moduli
from glisson.phantom.lever_lift import lever_lift
from glisson.phantom.lift_truths import lift_truth
from glisson.phantom.proportions import draw_proportions
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.attachments import DirectionAttachment, node_sets
from glisson.preoperative.model.regions import ORGAN, element_regions
from glisson.studies.lifts import (
    LIFT_PACKAGES,
    carried_centroid,
    inside,
    lift_model,
    outcome_of,
    rigidly_moved,
    with_contact,
)
from glisson.studies.meshing import mesh_of_size
from glisson.studies.point import Outcome, Task
from glisson.studies.sensitivity.choices import Choice, Tissue
from glisson.studies.store import read_arrays

_PACKAGES = (*LIFT_PACKAGES, "glisson.studies.lifts", "glisson.studies.meshing", __name__)
MESH = Task(f"{__name__}:make_mesh", _PACKAGES)
CALCULIX = Task(f"{__name__}:calculix_truth", _PACKAGES)
TWIN = Task(f"{__name__}:solve_twin", _PACKAGES)
LIFT = Task(f"{__name__}:solve_lift", _PACKAGES)

_SCAN_MM = (2.0, 2.0, 2.0)
_TWIN_LAW = "neo-hookean-log"
_TWIN_LEVELS = 12
_TWIN_ATTACHMENT = DirectionAttachment(reach=0.25, left_limit=0.5)
"""The models hold a reach of 0.3 and take 0.55 for the limit."""


def make_mesh(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """The phantom's mask, meshed with about so many `elements`; the tumour goes with it."""
    phantom = lift_truth(inputs["phantom"]).phantom(_SCAN_MM)
    surface = MarchingCubes(MarchingCubesParameters()).extract(phantom.organ.mask(ORGAN), phantom.organ)
    mesh, edge_mm = mesh_of_size(surface, inputs["elements"])
    regions, _ = element_regions(mesh, phantom.tumours)
    tumour = phantom.exact.tumours[0].surface
    arrays = {
        "nodes": mesh.nodes,
        "tetrahedra": mesh.tetrahedra,
        "regions": regions,
        "tumour_vertices": tumour.vertices,
        "tumour_triangles": tumour.triangles,
    }
    return Outcome({"elements": len(mesh.tetrahedra), "edge_length_mm": edge_mm}, arrays)


def calculix_truth(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Where CalculiX's displacements, which ship with the package, take the tumour."""
    deformation = lift_truth(inputs["phantom"]).read().deformation
    values = _truth_values(deformation, _tumours(inputs["phantom"])[0])
    return Outcome(values, {}, deformation.status, deformation.message)


def solve_twin(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """A finer and different model of the same liver.

    Its mesh is made of CalculiX's surface and not of the scan's mask, its law is the neo-Hookean one in
    logarithms, its tissue varies by ±15 %, the tumours stiffen it by the part of each element that they
    fill, and it is held elsewhere.
    """
    phantom, tissue = inputs["phantom"], Tissue(**inputs["tissue"])
    surface = boundary_surface(lift_truth(phantom).read().deformation.mesh)
    mesh, _ = mesh_of_size(surface, inputs["elements"])
    tumours = _tumours(phantom)
    moduli = uneven_moduli(mesh, tissue.young_modulus_kpa, [inside(tumour) for tumour in tumours])
    levels, means = stiffness_levels(moduli, _TWIN_LEVELS)
    model = Model(
        TetMesh(mesh.nodes, mesh.tetrahedra, levels),
        {n: Material(_TWIN_LAW, float(mean), tissue.poisson_ratio) for n, mean in enumerate(means)},
        {n: f"level {n}" for n in range(len(means))},
        node_sets(mesh, [_TWIN_ATTACHMENT]),
    )
    deformation = _lifted(phantom, model, "T10", tissue.friction, tissue.cohesion_kpa)
    more = _truth_values(deformation, tumours[0]) if deformation.status.is_good else {}
    return outcome_of(deformation, {"elements": len(mesh.tetrahedra), **more})


def solve_lift(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """The lift of one model; `centroid_mm` is where its tumour ends."""
    choice = Choice(**inputs["choice"])
    arrays = read_arrays(folder, inputs["mesh"])
    mesh = TetMesh(arrays["nodes"], arrays["tetrahedra"], arrays["regions"])
    tumour = Tumour("target", TriangleSurface(arrays["tumour_vertices"], arrays["tumour_triangles"]))
    model = lift_model(mesh, Material(choice.model, choice.young_modulus_kpa, choice.poisson_ratio))
    deformation = _lifted(inputs["phantom"], model, inputs["element"], choice.friction, choice.cohesion_kpa)
    more = {"centroid_mm": carried_centroid(deformation, tumour).tolist()} if deformation.status.is_good else {}
    return outcome_of(deformation, more)


def choice_inputs(choice: Choice, phantom: str, element: str, mesh: str) -> dict[str, Any]:
    """The inputs of `solve_lift`; `mesh` is the key of the mesh's point."""
    return {"choice": asdict(choice), "phantom": phantom, "element": element, "mesh": mesh}


def _lifted(phantom: str, model: Model, element: str, friction: float, cohesion_kpa: float) -> Deformation:
    scenario = with_contact(lever_lift(draw_proportions(lift_truth(phantom).seed)), friction, cohesion_kpa)
    return QuasiStatic(QuasiStaticParameters(element=element)).solve(model, scenario)


def _tumours(phantom: str) -> tuple[Tumour, ...]:
    """The tumours in A, the target first."""
    truth = lift_truth(phantom)
    loading = truth.read().loading
    return scanned_structures(build_anatomy(truth.seed, loading).interior, loading).tumours


def _truth_values(deformation: Deformation, tumour: Tumour) -> dict[str, Any]:
    before, after = tumour.centroid_mm, carried_centroid(deformation, tumour)
    return {
        "centroid_mm": after.tolist(),
        "uncorrected_mm": float(np.linalg.norm(after - before)),
        "rigid_mm": float(np.linalg.norm(after - rigidly_moved(deformation, before))),
    }
