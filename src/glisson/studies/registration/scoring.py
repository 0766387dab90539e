"""Scores of a registration on a case of the twin: the error at the targets, and how long it took."""

from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.model import Model
from glisson.core.protocols import Registration
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.geometry.mapping import PointMap
from glisson.phantom.sparse_data.case import SparseCase
from glisson.phantom.sparse_data.design import CaseDesign
from glisson.phantom.sparse_data.liver import build_sparse_liver
from glisson.studies.point import Outcome, Task
from glisson.studies.registration.best_rigid import of_data, of_targets
from glisson.studies.registration.solving_model import read_model
from glisson.studies.registration.truths import PACKAGES, build_case

_OURS = (*PACKAGES, "glisson.studies.registration")
HARDNESS = Task(f"{__name__}:score_hardness", _OURS)
SCORE = Task(f"{__name__}:score_technique", (*_OURS, "glisson.mechanics", "glisson.preoperative.model"))

NOTHING, BEST, BEST_OF_DATA = "no correction", "best rigid", "rigid, best start"
"""What every technique is held against: the organ not deformed though its place is known, and `best_rigid`."""


def target_errors(found: Registered, case: SparseCase) -> FloatArray:
    """How far each target (159,) is off, in mm."""
    return off_by(PointMap(found.deformation.mesh, found.deformation.displacement).forward(case.targets_mm), case)


def off_by(places: FloatArray, case: SparseCase) -> FloatArray:
    """How far the targets (159,) are off at some places (159, 3) of the room, in mm."""
    errors: FloatArray = np.linalg.norm(places - case.true_targets_mm, axis=1)
    return errors


def timed_registration(technique: Registration, model: Model, case: SparseCase) -> tuple[Registered, float]:
    """What a technique finds, and the milliseconds that it took."""
    started = perf_counter()
    found = technique.prepare(model).register(case.observations)
    return found, 1000.0 * (perf_counter() - started)


def score_technique(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """A technique by name on a case: `errors_mm` of its targets, and `milliseconds`."""
    case = build_case(CaseDesign(**inputs["case"]), folder, inputs["truth"])
    technique = make_technique("registration", inputs["technique"], inputs["parameters"], inputs["technique"])
    found, milliseconds = timed_registration(technique, read_model(folder, inputs["model"]), case)
    values = {"errors_mm": _short(target_errors(found, case)), "milliseconds": milliseconds}
    return Outcome(values, {}, found.status, found.deformation.message)


def score_hardness(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """What the best rigid registrations leave of a case, and what doing nothing does."""
    design = CaseDesign(**inputs["case"])
    case = build_case(design, folder, inputs["truth"])
    rigid = {BEST: of_targets(case), BEST_OF_DATA: of_data(case, build_sparse_liver(design.member))}
    errors = {name: _short(off_by(found.apply(case.targets_mm), case)) for name, found in rigid.items()}
    points = sum(len(item.points_mm) for item in case.observations.items)
    nothing = _short(off_by(case.room_from_patient.apply(case.targets_mm), case))
    return Outcome({"errors_mm": {NOTHING: nothing, **errors}, "points": points, "coverage": case.swab.coverage})


def _short(errors: FloatArray) -> list[float]:
    return [round(float(error), 4) for error in errors]
