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
from glisson.framework.case import MODEL, OBSERVATIONS, RESULTS, Case
from glisson.geometry.location import PointLocator
from glisson.geometry.mapping import PointMap
from glisson.io.deformation_files import write_deformation
from glisson.io.model_files import read_model
from glisson.io.observation_files import read_observations
from glisson.io.records import write_json

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
    """The answer, the tumours by it, and the folder in which both were written."""

    found: Registered
    tumours: tuple[TumourNow, ...]
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
        BadInput: there is no model, or the observations cannot be of it.
        StageFailed: the organ does not come to rest on what was seen.
    """
    if not case.has(MODEL):
        raise BadInput(f"The case {case.folder} has no model yet; make it with: glisson mesh {case.folder}")
    made = make_technique("registration", technique, parameters or {}, "register")
    model = read_model(case.path(MODEL))
    found: Registered = made.register(model, read_observations(observations or case.path(OBSERVATIONS)), progress)
    tumours = tuple(_now(tumour, found) for tumour in model.structures.tumours)
    folder = case.path(REGISTERED)
    folder.mkdir(parents=True, exist_ok=True)
    write_deformation(folder, found.deformation)
    write_json(folder / _ANSWER, answer_values(found, tumours) | {"technique": technique})
    return RegisteredCase(found, tumours, folder)


def answer_values(found: Registered, tumours: tuple[TumourNow, ...]) -> dict[str, Any]:
    """The answer in plain values."""
    return {
        "status": found.status.value,
        "message": found.deformation.message,
        "frame": found.frame,
        "unobserved": list(found.unobserved),
        "set_aside": found.set_aside,
        "sigma_mm": float(np.median(_sigma(found))),
        "tumours": [vars(tumour) for tumour in tumours],
        "notes": list(found.notes),
    }


def _sigma(found: Registered) -> FloatArray:
    """Standard deviation (n,) of each node along its least certain direction."""
    sigma: FloatArray = np.linalg.norm(found.spread_mm, ord=2, axis=(1, 2))
    return sigma


def _now(tumour: Tumour, found: Registered) -> TumourNow:
    mesh, before = found.deformation.mesh, tumour.centroid_mm
    after = PointMap(mesh, found.deformation.displacement).forward(before)[0]
    locator = PointLocator(mesh)
    location = locator.locate(before)
    covariance = found.covariance(mesh.tetrahedra[location.elements], locator.weights(location))[0]
    radius = float(np.sqrt(chi2.ppf(0.95, 3) * np.linalg.eigvalsh(covariance)[-1]))
    return TumourNow(tumour.name, _three(before), _three(after), radius)


def _three(point: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return x, y, z
