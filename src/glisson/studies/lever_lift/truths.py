"""How the livers were truly lifted: as CalculiX has it, or as a finer and different model of ours."""

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from glisson import mechanics
from glisson.core.deformation import Deformation, StageResult
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.status import Status
from glisson.core.structures import Structures
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.phantom.family import build_anatomy, scanned_structures
from glisson.phantom.heterogeneity import stiffness_levels, uneven_moduli
from glisson.phantom.lift_truths import lift_truth
from glisson.phantom.proportions import draw_proportions
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.model.attachments import DirectionAttachment, node_sets
from glisson.studies.lever_lift.cases import LeverCase, true_scenario
from glisson.studies.lifts import inside
from glisson.studies.meshing import member_surface
from glisson.studies.point import Outcome, Point, Task
from glisson.studies.store import read_arrays

_SOLVER = tuple(
    f"glisson.mechanics.{found.name}"
    for found in iter_modules(mechanics.__path__)
    if found.name not in ("reduced", "registration")
)
"""The solver without what is under test or does not serve here: no truth is made anew because that has changed."""

PACKAGES = (
    "glisson.core", "glisson.geometry", "glisson.phantom", "glisson.studies.lifts", "glisson.studies.meshing",
    "glisson.studies.lever_lift.cases",
)  # fmt: skip
TRUTH = Task(f"{__name__}:solve_truth", (*PACKAGES, *_SOLVER, "glisson.preoperative", __name__))

_LAW = "neo-hookean-log"
_LEVELS = 12
_ATTACHMENT = DirectionAttachment(reach=0.25, left_limit=0.5)
"""The models under test hold a reach of 0.3 and take 0.55 for the limit."""


def truth_point(case: LeverCase, edge_mm: float, envelope_mm: float) -> Point:
    """The point that solves the truth of a case, or reads it."""
    inputs = {"case": asdict(case), "edge_mm": edge_mm, "envelope_mm": envelope_mm}
    return Point(TRUTH, inputs, cost=0.1 if case.calculix else 4.0)


def solve_truth(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Mesh in A (T10), displacement (n, 3) at the end of the lift."""
    case = case_of(inputs)
    if case.calculix is None:
        deformation = _solved(case, inputs["edge_mm"], inputs["envelope_mm"])
    else:
        deformation = lift_truth(case.calculix).read().deformation
    mesh = deformation.mesh
    if not deformation.status.is_good:
        return Outcome(status=deformation.status, message=deformation.message)
    arrays = {"nodes": mesh.nodes, "tetrahedra": mesh.tetrahedra, "displacement": deformation.displacement}
    return Outcome({"elements": len(mesh.tetrahedra)}, arrays)


def read_truth(folder: Path, key: str) -> Deformation:
    """The truth that a point has solved.

    Raises:
        OSError: its file is missing or damaged.
    """
    arrays = read_arrays(folder, key)
    mesh = TetMesh(arrays["nodes"], arrays["tetrahedra"])
    return Deformation(
        mesh, (StageResult("lift", arrays["displacement"], Status.CONVERGED),), Status.CONVERGED, "A truth."
    )


def case_of(inputs: Mapping[str, Any]) -> LeverCase:
    """The case among the inputs of a point."""
    values = dict(inputs["case"])
    values |= {name: tuple(values[name]) for name in ("placed_mm", "place_off_mm")}
    return LeverCase(**values)


def structures_of(case: LeverCase) -> Structures:
    """Tumours, vessels and duct in A."""
    loading = None if case.calculix is None else lift_truth(case.calculix).read().loading
    return scanned_structures(build_anatomy(case.member, loading).interior, loading)


def _solved(case: LeverCase, edge_mm: float, envelope_mm: float) -> Deformation:
    """Another law, tissue that varies by ±15 %, stiffer tumours, another attachment than the model under test has."""
    surface = member_surface(draw_proportions(case.member))
    mesh = Mmg(MmgParameters(edge_length_mm=edge_mm, envelope_mm=envelope_mm)).mesh(surface)
    tumours = [inside(tumour) for tumour in structures_of(case).tumours]
    levels, means = stiffness_levels(uneven_moduli(mesh, case.young_modulus_kpa, tumours), _LEVELS)
    model = Model(
        TetMesh(mesh.nodes, mesh.tetrahedra, levels),
        {n: Material(_LAW, float(mean), case.poisson_ratio) for n, mean in enumerate(means)},
        {n: f"level {n}" for n in range(len(means))},
        node_sets(mesh, [_ATTACHMENT]),
    )
    return QuasiStatic(QuasiStaticParameters()).solve(model, true_scenario(case))
