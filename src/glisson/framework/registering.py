"""The model of a case, registered to what was seen during surgery, frame by frame."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.observations import Observations
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
from glisson.mechanics.registration.following import Followed, Following
from glisson.mechanics.registration.next_touch import touches, viewer

DEFAULT = "tractions"
REGISTERED = f"{RESULTS}/registered"
_ANSWER = "registration.json"


@dataclass(frozen=True, eq=False)
class RegisteredCase:
    """The answer of the last frame, all of it and of each frame in plain `values`, and the folder where it lies."""

    found: Registered
    values: dict[str, Any]
    folder: Path


def register_case(
    case: Case,
    observations: Sequence[str | Path] = (),
    technique: str = DEFAULT,
    parameters: Mapping[str, Any] | None = None,
    progress: Progress = silent,
) -> RegisteredCase:
    """Register the case's model and write `results/registered`.

    Args:
        case: with a model (`glisson mesh`).
        observations: the file of what was seen, several for frames one after another; by default the case's own
            `observations.json`.
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
    files = [Path(file) for file in observations] or [case.path(OBSERVATIONS)]
    seen = [read_observations(file) for file in files]
    if not any(len(item.points_mm) for one in seen for item in one.items):
        raise BadInput(f"{files[0]} holds no observations; give surface points, landmarks, curves or contacts.")
    following = Following(model, made.prepare(model, scenario, progress))
    frames = []
    for number, (file, one) in enumerate(zip(files, seen, strict=True)):
        progress(number / len(files), f"frame {number + 1} of {len(files)}" if len(files) > 1 else "fitting")
        try:
            frames.append(following.next(one))
        except BadInput as refused:
            raise BadInput(f"{file}: {refused}") from None
    told = [_values(frame, model.structures.tumours) for frame in frames]
    touch = _next_touch(frames[-1].found, seen[-1], model.structures.tumours)
    values = told[-1] | touch | {"technique": technique, "frames": told}
    with exclusive(case.folder), atomic_folder(case.path(REGISTERED)) as folder:
        write_deformation(folder, frames[-1].found.deformation)
        write_json(folder / _ANSWER, values)
    return RegisteredCase(frames[-1].found, values, case.path(REGISTERED))


def _values(answer: Followed, tumours: Iterable[Tumour]) -> dict[str, Any]:
    found = answer.found
    nodes = np.arange(len(found.spread_mm))[:, None]
    largest = np.linalg.eigvalsh(found.covariance(nodes, np.ones(nodes.shape)))[:, -1]
    return {
        "status": found.status.value,
        "message": found.deformation.message,
        "frame": found.frame,
        "unobserved": list(found.unobserved),
        "set_aside": found.set_aside,
        "sigma_mm": float(np.sqrt(np.median(largest))),
        "tumours": [_now(tumour, found) for tumour in tumours],
        "time_s": answer.time_s,
        "moved_mm": answer.moved_mm,
        "jumped": answer.jumped,
        "notes": list(found.notes),
    }


def _now(tumour: Tumour, found: Registered) -> dict[str, Any]:
    """A tumour's centroid in the scan and in the observations' frame, and the radius that holds it by 95 %, mm."""
    nodes, weights = _nodes_of(tumour, found)
    covariance = found.covariance(nodes[None], weights[None])[0]
    return {
        "name": tumour.name,
        "before_mm": tumour.centroid_mm.tolist(),
        "after_mm": (weights @ found.positions_mm[nodes]).tolist(),
        "radius95_mm": float(np.sqrt(chi2.ppf(0.95, 3) * np.linalg.eigvalsh(covariance)[-1])),
    }


def _next_touch(found: Registered, seen: Observations, tumours: Sequence[Tumour]) -> dict[str, Any]:
    """Where to touch next for the first tumour, mm in the observations' frame, and what that is expected to change.

    Null where there is no tumour, or nothing of the surface was seen.
    """
    towards = viewer(found, seen)
    if not tumours or towards is None:
        return {"next_touch_mm": None, "next_touch": None}
    offered = touches(found, *_nodes_of(tumours[0], found), towards)
    variance, drop = offered.trace_mm2, float(offered.drops_mm2[offered.best])
    sigmas = {"rms_before_mm": float(np.sqrt(variance)), "rms_after_mm": float(np.sqrt(variance - drop))}
    point = offered.points_mm[offered.best].tolist()
    return {"next_touch_mm": point, "next_touch": {"tumour": tumours[0].name, **sigmas}}


def _nodes_of(tumour: Tumour, found: Registered) -> tuple[IntArray, FloatArray]:
    """Nodes (a,) of which the tumour's centroid is a mean, and their weights (a,)."""
    locator = PointLocator(found.deformation.mesh)
    location = locator.locate(tumour.centroid_mm)
    return found.deformation.mesh.tetrahedra[location.elements[0]], locator.weights(location)[0]
