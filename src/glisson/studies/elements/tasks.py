"""The computation of the study: a block of liver hangs from both ends, one of which is lifted."""

from collections.abc import Mapping
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.deformation import Deformation
from glisson.core.model import Material, Model
from glisson.core.scenario import ContactLaw, Move, Scenario, Stage
from glisson.geometry.boxes import box_mesh
from glisson.geometry.mapping import PointMap
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.studies.point import Outcome, Task
from glisson.studies.store import read_arrays

SOLVE = Task(f"{__name__}:solve_block", ("glisson.core", "glisson.geometry", "glisson.mechanics", __name__))

SIZES = (150.0, 100.0, 50.0)
_YOUNG_MODULUS_KPA = 8.0
_LIFT_MM = (-8.0, 0.0, 40.0)
_TARGET_MM, _TARGET_RADIUS_MM = np.array([100.0, 50.0, 25.0]), 12.0
_TARGET_POINTS, _ALL_POINTS = 200, 2000
_TINY = 1


def counts_of(cubes: int) -> tuple[int, int, int]:
    """Cubes along the block's sides, `cubes` of them across it; each has six elements."""
    return 3 * cubes, 2 * cubes, cubes


def sample_points() -> FloatArray:
    """Points (n, 3) in mm: first those of the target, then those of the whole block."""
    rng = np.random.default_rng(0)
    away = rng.normal(size=(_TARGET_POINTS, 3))
    reach = _TARGET_RADIUS_MM * rng.uniform(size=(_TARGET_POINTS, 1)) ** (1.0 / 3.0)
    target = _TARGET_MM + reach * away / np.linalg.norm(away, axis=1, keepdims=True)
    return np.vstack([target, rng.uniform(0.0, SIZES, (_ALL_POINTS, 3))])


def target_error_mm(displacement: FloatArray, reference: FloatArray) -> float:
    """Distance of the target's centroid from where the reference puts it."""
    return float(np.linalg.norm((displacement - reference)[:_TARGET_POINTS].mean(axis=0)))


def whole_error_mm(displacement: FloatArray, reference: FloatArray) -> float:
    """Root mean square of the distances of all points."""
    away = (displacement - reference)[_TARGET_POINTS:]
    return float(np.sqrt(np.sum(away**2, axis=1).mean()))


def solve_block(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Seconds of the solve alone (a tiny one before it compiles), and errors against the point `reference`.

    Without `reference` the displacements of the sample points are kept, for other points to refer to.
    """
    _solved(inputs["element"], _TINY, inputs["poisson_ratio"])
    started = perf_counter()
    deformation = _solved(inputs["element"], inputs["cubes"], inputs["poisson_ratio"])
    seconds = perf_counter() - started
    mesh = deformation.mesh
    values: dict[str, Any] = {"solve_seconds": seconds, "elements": len(mesh.tetrahedra), "unknowns": mesh.nodes.size}
    if not deformation.status.is_good:
        return Outcome(values, {}, deformation.status, deformation.message)
    points = sample_points()
    displacement = PointMap(mesh, deformation.displacement).forward(points) - points
    if "reference" not in inputs:
        return Outcome(values, {"displacement": displacement}, deformation.status, deformation.message)
    reference = read_arrays(folder, inputs["reference"])["displacement"]
    values["target_mm"] = target_error_mm(displacement, reference)
    values["whole_mm"] = whole_error_mm(displacement, reference)
    return Outcome(values, {}, deformation.status, deformation.message)


def _solved(element: str, cubes: int, poisson_ratio: float) -> Deformation:
    mesh = box_mesh(SIZES, counts_of(cubes))
    x = mesh.nodes[:, 0]
    material = Material("neo-hookean", _YOUNG_MODULUS_KPA, poisson_ratio)
    ends = {"left": np.flatnonzero(x == 0.0), "right": np.flatnonzero(x == SIZES[0])}
    model = Model(mesh, {0: material}, {0: "block"}, ends)
    lift = Stage("lift", ContactLaw(), fixed=("left",), moves=(Move("right", _LIFT_MM),))
    scenario = Scenario((), (lift,), surgery_gravity=np.array([0.0, 0.0, -1.0]), rest_shape="as-scanned")
    return QuasiStatic(QuasiStaticParameters(element=element)).solve(model, scenario)
