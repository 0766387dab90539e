"""The model of a case, registered to what was seen during surgery."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.protocols import Progress, silent
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.core.structures import Tumour
from glisson.framework.case import MODEL, OBSERVATIONS, RESULTS, SCENARIO, Case
from glisson.framework.lock import exclusive
from glisson.geometry.location import PointLocator
from glisson.io.atomic import atomic_folder
from glisson.io.deformation_files import write_deformation
from glisson.io.model_files import read_model
from glisson.io.observation_files import read_observations
from glisson.io.records import write_json
from glisson.io.scenario_files import read_scenario

LINEAR_BASIS = "linear-basis"
REGISTERED = f"{RESULTS}/registered"
_ANSWER = "registration.json"


@dataclass(frozen=True)
class TumourNow:
    """A tumour's centroid in the scan and in the observations' frame, and the radius that holds it by 95 %, mm."""

    name: str
    before_mm: tuple[float, float, float]
    after_mm: tuple[float, float, float]
    radius95_mm: float


@dataclass(frozen=True, eq=False)
class RegisteredCase:
    """The answer, the tumours by it, all of it in plain `values`, and the folder in which it was written."""

    found: Registered
    tumours: tuple[TumourNow, ...]
    values: dict[str, Any]
    folder: Path


def register_case(
    case: Case,
    observations: str | Path | None = None,
    technique: str = LINEAR_BASIS,
    parameters: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> RegisteredCase:
    """Register the case's model and write `results/registered`.

    Args:
        case: with a model (`glisson mesh`).
        observations: the file of what was seen; by default the case's own `observations.json`.
        technique: of the kind registration.
        parameters: of the technique.
        progress: told how far it is.

    Raises:
        BadInput: there is no model, the observations cannot be of it, or the case cannot be written.
        StageFailed: the organ does not come to rest on what was seen.
        WriteFailed: the disk is full.
    """
    if not case.has(MODEL):
        raise BadInput(f"The case {case.folder} has no model yet; make it with: glisson mesh {case.folder}")
    case.check_writable()
    made = make_technique("registration", technique, parameters or {}, "register")
    model = read_model(case.path(MODEL))
    scenario = read_scenario(case.path(SCENARIO)) if case.has(SCENARIO) else None
    seen = read_observations(observations or case.path(OBSERVATIONS))
    found: Registered = made.prepare(model, scenario, progress).register(seen, None, progress)
    tumours = tuple(_now(tumour, found) for tumour in model.structures.tumours)
    values = _values(found, tumours) | {"technique": technique}
    with exclusive(case.folder), atomic_folder(case.path(REGISTERED)) as folder:
        write_deformation(folder, found.deformation)
        write_json(folder / _ANSWER, values)
    return RegisteredCase(found, tumours, values, case.path(REGISTERED))


def _values(found: Registered, tumours: tuple[TumourNow, ...]) -> dict[str, Any]:
    nodes = np.arange(len(found.spread_mm))[:, None]
    largest = np.linalg.eigvalsh(found.covariance(nodes, np.ones(nodes.shape)))[:, -1]
    return {
        "status": found.status.value,
        "message": found.deformation.message,
        "frame": found.frame,
        "unobserved": list(found.unobserved),
        "set_aside": found.set_aside,
        "sigma_mm": float(np.sqrt(np.median(largest))),
        "tumours": [vars(tumour) for tumour in tumours],
        "notes": list(found.notes),
    }


def _now(tumour: Tumour, found: Registered) -> TumourNow:
    mesh, before = found.deformation.mesh, tumour.centroid_mm
    locator = PointLocator(mesh)
    location = locator.locate(before)
    after = locator.interpolate(location, found.positions_mm)[0]
    covariance = found.covariance(mesh.tetrahedra[location.elements], locator.weights(location))[0]
    radius = float(np.sqrt(chi2.ppf(0.95, 3) * np.linalg.eigvalsh(covariance)[-1]))
    return TumourNow(tumour.name, _three(before), _three(after), radius)


def _three(point: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z
