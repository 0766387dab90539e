"""One liver's cases: what the registration says of its error, what that is, and what one more touch changes."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.observations import Observation, Observations
from glisson.core.protocols import PreparedRegistration
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.framework.registering import DEFAULT
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.location import PointLocator
from glisson.mechanics.registration.next_touch import Touches, touches, viewer
from glisson.phantom.sparse_data.case import SparseCase
from glisson.phantom.sparse_data.design import CaseDesign
from glisson.phantom.sparse_data.liver import build_sparse_liver
from glisson.studies.point import Outcome, Task
from glisson.studies.registration.scoring import SCORE
from glisson.studies.registration.solving_model import read_model
from glisson.studies.registration.truths import build_case, carry_of

LIVER = Task(f"{__name__}:score_liver", (*SCORE.packages, __name__))

PROPOSED, RANDOM = "proposed", "random"
STYLUS_MM = 0.5
"""Standard deviation of a touch in each coordinate."""

_STREAM = 7


def score_liver(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """`rows`, one for each case of a liver; those whose numbers are in `touched` are touched once more, too."""
    model = read_model(folder, inputs["model"])
    prepared = make_technique("registration", DEFAULT, {}, DEFAULT).prepare(model)
    locator = PointLocator(model.mesh)
    rows = []
    for values in inputs["cases"]:
        design = CaseDesign(**values)
        truth = inputs["truth"] if design.origin == "packed" else None
        rows.append(_row(design, folder, truth, prepared, locator, design.number in inputs["touched"]))
    return Outcome({"rows": rows})


def _row(
    design: CaseDesign, folder: Path, truth: str | None, prepared: PreparedRegistration, locator: PointLocator,
    is_touched: bool,
) -> dict[str, Any]:  # fmt: skip
    case = build_case(design, folder, truth)
    row: dict[str, Any] = {**vars(design), "squares": [], "predicted_mm": None, "actual_mm": None, "touch": None}
    try:
        found = prepared.register(case.observations)
        row |= {"status": found.status.value, "message": found.deformation.message, **_judged(found, case, locator)}
        if is_touched:
            surface = build_sparse_liver(design.member).surface
            there = case.room_from_patient.apply(carry_of(design, folder, truth)(surface.vertices))
            row["touch"] = _touched(prepared, found, case, locator, SurfaceTree(there, surface.triangles))
    except StageFailed as failure:
        row |= {"status": failure.status.value, "message": str(failure)}
    return row


def _judged(found: Registered, case: SparseCase, locator: PointLocator) -> dict[str, Any]:
    """Squared Mahalanobis lengths of the targets' errors (159,), and the mean error that was expected and that is."""
    location = locator.locate(case.targets_mm)
    covariance = found.covariance(locator.mesh.tetrahedra[location.elements], locator.weights(location))
    off = locator.interpolate(location, found.positions_mm) - case.true_targets_mm
    squares = np.einsum("ti,tij,tj->t", off, np.linalg.inv(covariance), off)
    return {
        "squares": [round(float(square), 4) for square in squares],
        "predicted_mm": float(expected_length(covariance).mean()),
        "actual_mm": float(np.linalg.norm(off, axis=1).mean()),
    }


def expected_length(covariance: FloatArray) -> FloatArray:
    """Mean length (t,) of normal vectors of zero mean and covariance (t, 3, 3), in their unit.

    By the mean and the variance of the squared length to second order: within 1 % where all axes are alike, up
    to 7 % too small where only one counts.
    """
    trace = np.trace(covariance, axis1=1, axis2=2)
    lengths: FloatArray = np.sqrt(trace) * (1.0 - (covariance**2).sum(axis=(1, 2)) / (4.0 * trace**2))
    return lengths


def _touched(
    prepared: PreparedRegistration, found: Registered, case: SparseCase, locator: PointLocator, truth: SurfaceTree
) -> dict[str, float] | None:
    """Error (mm) of a tumour, one of the targets, before and after a touch at the proposed point and at any other."""
    design = case.design
    random = np.random.default_rng([design.seed, design.member, design.number, _STREAM])
    tumour = int(random.integers(len(case.targets_mm)))
    location = locator.locate(case.targets_mm[tumour])
    nodes, weights = locator.mesh.tetrahedra[location.elements[0]], locator.weights(location)[0]
    towards = viewer(found, case.observations)
    if towards is None:
        return None
    offered = touches(found, nodes, weights, towards)
    chosen = {PROPOSED: offered.best, RANDOM: _any(offered, random)}
    errors = {"before": float(np.linalg.norm(weights @ found.positions_mm[nodes] - case.true_targets_mm[tumour]))}
    for name, number in chosen.items():
        place = truth.nearest(offered.points_mm[number]).closest_mm + random.normal(scale=STYLUS_MM, size=(1, 3))
        touch = Observation("surface", "touch", place, STYLUS_MM, case.observations.frame)
        after = prepared.register(Observations((*case.observations.items, touch)), found)
        errors[name] = float(np.linalg.norm(weights @ after.positions_mm[nodes] - case.true_targets_mm[tumour]))
    return errors


def _any(offered: Touches, random: np.random.Generator) -> int:
    """Any of the points, by their areas."""
    return int(random.choice(len(offered.areas_mm2), p=offered.areas_mm2 / offered.areas_mm2.sum()))
