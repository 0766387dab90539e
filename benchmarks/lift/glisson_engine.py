"""A solver technique of Glisson: `python glisson_engine.py TECHNIQUE [--without-mkl] MESH OUT`."""

import sys
import time
from pathlib import Path

from measuring import Failed, Solution, peak_mb, resident_mb, write
from meshes import lift_mesh
from problem import load_problem, model_of, scenario

import glisson
from glisson.core.deformation import Deformation
from glisson.core.mesh import TetMesh
from glisson.core.registry import make_technique
from glisson.mechanics import linear_solvers

_WARM_UP_ELEMENTS = 2_000


def _solve(technique: str, element: str, mesh: TetMesh) -> Deformation:
    # By region elements always are T10.
    settings = {"element": element} if technique == "quasi-static" else {}
    solver = make_technique("solver", technique, settings, "the benchmark")
    found = solver.solve(model_of(mesh), scenario())
    if not found.status.is_good:
        raise Failed(found.message)
    return found


def _main(technique: str, problem_path: Path, out: Path) -> None:
    problem = load_problem(problem_path)
    _solve(technique, problem.element, lift_mesh(_WARM_UP_ELEMENTS))
    mesh, before = problem.corner_mesh, resident_mb()
    start = time.perf_counter()
    found = _solve(technique, problem.element, mesh)
    seconds = time.perf_counter() - start
    # Each load step begins with a first-order answer, which is one more linear solve.
    iterations = sum(step.iterations + 1 for step in found.record)
    write(out, glisson.__version__, Solution(found.displacement, iterations), seconds, before, peak_mb())


if __name__ == "__main__":
    if "--without-mkl" in sys.argv:
        linear_solvers.pardiso_library = lambda: None  # as where MKL is not installed
    _main(sys.argv[1], Path(sys.argv[-2]), Path(sys.argv[-1]))
