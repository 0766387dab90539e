"""How the twin's livers are deformed: by finite elements once for each liver, or in closed form."""

from collections.abc import Mapping
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

import numpy as np

from glisson import mechanics
from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.mesh import TetMesh
from glisson.core.status import Status
from glisson.geometry.distance import SurfaceTree
from glisson.geometry.mapping import PointMap
from glisson.mechanics.quasi_static import QuasiStatic, QuasiStaticParameters
from glisson.phantom.proportions import draw_proportions
from glisson.phantom.sparse_data.case import Carry, SparseCase, bend_of, make_case
from glisson.phantom.sparse_data.design import CaseDesign
from glisson.phantom.sparse_data.liver import build_sparse_liver
from glisson.phantom.sparse_data.packing import draw_packing, packed
from glisson.studies.meshing import member_mesh
from glisson.studies.point import Outcome, Point, Task
from glisson.studies.store import read_arrays

PACKAGES = ("glisson.core", "glisson.geometry", "glisson.phantom", "glisson.studies.meshing")
"""Ours on whose source every point of the twin rests."""

_SOLVER = tuple(
    f"glisson.mechanics.{found.name}"
    for found in iter_modules(mechanics.__path__)
    if found.name not in ("reduced", "registration")
)
"""The solver without what is under test or does not serve here: no truth is made anew because that has changed."""

PACK = Task(f"{__name__}:pack_liver", (*PACKAGES, *_SOLVER, "glisson.preoperative.meshing", __name__))

_ATTEMPTS = 3

TRUTH_EDGE_MM = 14.0
"""Some 10,000 quadratic elements, where the models under test are coarser and may be linear."""


def truth_point(seed: int, member: int, packings: int, edge_mm: float | None = None) -> Point:
    """The point that packs one liver in so many ways, with elements of that edge length (default `TRUTH_EDGE_MM`)."""
    edge = TRUTH_EDGE_MM if edge_mm is None else edge_mm
    return Point(PACK, {"seed": seed, "member": member, "packings": packings, "edge_mm": edge}, cost=packings + 0.6)


def pack_liver(inputs: Mapping[str, Any], folder: Path) -> Outcome:
    """Displacements (packings, n, 3) in mm of one T10 mesh of a liver."""
    member = inputs["member"]
    mesh = member_mesh(draw_proportions(member), inputs["edge_mm"]).as_quadratic()
    numbers = range(inputs["packings"])
    found, attempts = zip(*(_packed(mesh, inputs["seed"], member, number) for number in numbers), strict=True)
    arrays = {"nodes": mesh.nodes, "tetrahedra": mesh.tetrahedra, "displacements": np.array(found)}
    return Outcome({"elements": len(mesh.tetrahedra), "redrawn": sum(attempts)}, arrays)


def _packed(mesh: TetMesh, seed: int, member: int, number: int) -> tuple[FloatArray, int]:
    """Displacements (n, 3) of the first draw that comes to rest, and how many did not before it."""
    for attempt in range(_ATTEMPTS):
        model, scenario = packed(draw_packing(seed, member, number, attempt), mesh, build_sparse_liver(member))
        deformation = QuasiStatic(QuasiStaticParameters()).solve(model, scenario)
        if deformation.status is Status.CONVERGED:
            return deformation.displacement, attempt
    raise StageFailed(f"Liver {member}, packing {number}: {deformation.message}", deformation.status)


def build_case(design: CaseDesign, folder: Path, truth: str | None) -> SparseCase:
    """A case of the twin.

    Args:
        design: which.
        folder: of the study's points.
        truth: the key of the point that packed its liver; not needed by a case in closed form.

    Raises:
        OSError: that point's file is missing or damaged.
    """
    return make_case(design, build_sparse_liver(design.member), carry_of(design, folder, truth))


def carry_of(design: CaseDesign, folder: Path, truth: str | None) -> Carry:
    """How a case is deformed; see `build_case`."""
    if truth is None:
        return bend_of(design, build_sparse_liver(design.member)).forward
    arrays = read_arrays(folder, truth)
    mesh = TetMesh(arrays["nodes"], arrays["tetrahedra"])
    return with_its_skin(mesh, arrays["displacements"][design.deformation])


def with_its_skin(mesh: TetMesh, displacement: FloatArray) -> Carry:
    """The map of a displacement (n, 3); what lies just outside the mesh moves as the nearest point of its surface does.

    To go on linearly would roughen the surface where an element under it is strained much.
    """
    moved, skin = PointMap(mesh, displacement), mesh.surface()
    tree = SurfaceTree(skin.vertices, skin.triangles)

    def carry(points: FloatArray) -> FloatArray:
        within = np.array(points, dtype=np.float64)
        outside = moved.locate(within).distance_mm > 0.0
        within[outside] = tree.nearest(within[outside]).closest_mm
        return np.asarray(points) + moved.forward(within) - within

    return carry
