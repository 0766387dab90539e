"""Whether an answer depends on where the organ was thought to be: three bad starts, and the answers held together."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.registered import Registered
from glisson.core.registry import make_technique
from glisson.geometry.mapping import PointMap
from glisson.phantom.sparse_data.design import CaseDesign
from glisson.studies.point import Outcome, Task
from glisson.studies.registration.scoring import SCORE
from glisson.studies.registration.solving_model import read_model
from glisson.studies.registration.truths import build_case

STARTS = Task(f"{__name__}:score_starts", (*SCORE.packages, __name__))

_STARTS = 3
_TURNS_DEG, _SHIFTS_MM = (10.0, 30.0), (10.0, 30.0)
_STREAM = 8


def score_starts(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """`apart_mm`: the largest distance of any target between any two answers, each from another bad last answer."""
    design = CaseDesign(**inputs["case"])
    case = build_case(design, folder, inputs["truth"])
    random = np.random.default_rng([design.seed, design.member, design.number, _STREAM])
    prepared = make_technique("registration", inputs["technique"], {}, inputs["technique"]).prepare(
        read_model(folder, inputs["model"])
    )
    known = prepared.register(case.observations)
    answers = [prepared.register(case.observations, thrown(known, random)) for _ in range(_STARTS)]
    places = [PointMap(one.deformation.mesh, one.deformation.displacement).forward(case.targets_mm) for one in answers]
    return Outcome({"apart_mm": max(_apart(one, other) for one, other in combinations(places, 2))})


def thrown(found: Registered, random: np.random.Generator) -> Registered:
    """The answer turned about its middle by 10 to 30 degrees, and shifted by 10 to 30 mm."""
    middle, ways = found.positions_mm.mean(axis=0), random.normal(size=(2, 3))
    axis, way = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    turn = Rotation.from_rotvec(np.radians(random.uniform(*_TURNS_DEG)) * axis)
    away = turn.apply(found.positions_mm - middle) + middle + random.uniform(*_SHIFTS_MM) * way
    stage = replace(found.deformation.stages[-1], displacement=away - found.deformation.mesh.nodes)
    return replace(found, deformation=replace(found.deformation, stages=(stage,)))


def starts(apart_mm: Sequence[float]) -> dict[str, Any] | None:
    """How far answers from different starts are apart, over some cases; None where none is done."""
    if not apart_mm:
        return None
    median, p95, worst = np.percentile(apart_mm, [50, 95, 100])
    return {"cases": len(apart_mm), "apart_mm": {"median": median, "p95": p95, "worst": worst}}


def _apart(one: FloatArray, other: FloatArray) -> float:
    return float(np.linalg.norm(one - other, axis=1).max())
