"""What studies of the lever lift share: the model, its contact law, and what is told of a solved lift."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh, TriangleSurface
from glisson.core.model import Material, Model
from glisson.core.scenario import ContactLaw, Scenario
from glisson.core.structures import Tumour
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.mapping import PointMap
from glisson.phantom.heterogeneity import Contains
from glisson.preoperative.model.attachments import DEFAULT_ATTACHMENTS, node_sets
from glisson.preoperative.model.model_building import ModelSettings
from glisson.preoperative.model.regions import ORGAN
from glisson.studies.point import Outcome

LIFT_PACKAGES = ("glisson.core", "glisson.geometry", "glisson.mechanics", "glisson.phantom", "glisson.preoperative")
"""Ours on whose source a solved lift rests, beside the study's own."""


def lift_model(mesh: TetMesh, liver: Material) -> Model:
    """The model that a user would have: one liver, tumours (regions from 1 on) stiffer, the default attachment."""
    settings = ModelSettings({ORGAN: liver})
    names = {int(n): ORGAN if n == 0 else f"tumour{n}" for n in np.unique(mesh.region_numbers)}
    materials = {number: settings.material_of(name) for number, name in names.items()}
    return Model(mesh, materials, names, node_sets(mesh, DEFAULT_ATTACHMENTS))


def with_contact(scenario: Scenario, friction: float, cohesion_kpa: float) -> Scenario:
    """The manoeuvre with other coefficients; a stage without cohesion (the settling) stays without it."""
    stages = [
        replace(stage, contact=ContactLaw(friction, cohesion_kpa if stage.contact.cohesion_kpa > 0.0 else 0.0))
        for stage in scenario.stages
    ]
    return replace(scenario, stages=tuple(stages))


def lift_values(deformation: Deformation) -> dict[str, Any]:
    """How a solve went: load steps, iterations, events, and the least gap (mm) to a tool at a stage's end."""
    gaps = [c.least_gap_mm for stage in deformation.stages for c in stage.contacts if c.least_gap_mm is not None]
    return {
        "load_steps": len(deformation.record),
        "iterations": sum(step.iterations for step in deformation.record),
        "events": [asdict(event) for event in deformation.events],
        "least_gap_mm": min(gaps, default=None),
    }


def outcome_of(deformation: Deformation, more: Mapping[str, Any]) -> Outcome:
    """The outcome of a point that solved a lift, with `more` values."""
    return Outcome({**lift_values(deformation), **more}, {}, deformation.status, deformation.message)


def carried_centroid(deformation: Deformation, tumour: Tumour) -> FloatArray:
    """Centroid (3,) of a tumour of A, LPS mm, at the end of the last stage."""
    surface = tumour.surface
    carried = PointMap(deformation.mesh, deformation.displacement).forward(surface.vertices)
    return Tumour(tumour.name, TriangleSurface(carried, surface.triangles)).centroid_mm


def rigidly_moved(deformation: Deformation, point: FloatArray) -> FloatArray:
    """Where the rigid motion that fits the organ's whole surface best takes a point (3,) of A.

    The surface's points are taken to be known one by one, which is more than any rigid registration has.
    """
    boundary, _ = deformation.mesh.boundary()
    nodes = np.unique(boundary)
    before = deformation.mesh.nodes[nodes]
    after = deformation.mesh.moved(deformation.displacement)[nodes]
    turn, _ = Rotation.align_vectors(after - after.mean(axis=0), before - before.mean(axis=0))
    moved: FloatArray = turn.apply(point - before.mean(axis=0)) + after.mean(axis=0)
    return moved


def inside(tumour: Tumour) -> Contains:
    """Which points (..., 3) lie in a tumour."""
    surface = tumour.surface
    tree = SurfaceTree(surface.vertices, surface.triangles)
    low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)

    def contains(points: FloatArray) -> NDArray[np.bool_]:
        within: NDArray[np.bool_] = ((points > low) & (points < high)).all(axis=-1)
        within[within] = tree.contains(points[within])
        return within

    return contains
