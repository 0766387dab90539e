"""Glisson's quasi-static solver, in its own environment."""

import numpy as np
from adapter import run
from measuring import Failed, Solution
from problem import DENSITY_KG_M3, LIFT_MM, POISSON_RATIO, TOLERANCE, YOUNG_MODULUS_KPA, Problem

import glisson
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.core.registry import make_technique
from glisson.core.scenario import ContactLaw, Move, Scenario, Stage


def _read(problem: Problem) -> Model:
    material = Material("neo-hookean", YOUNG_MODULUS_KPA, POISSON_RATIO, DENSITY_KG_M3)
    sets = {"clamped": problem.clamped, "carried": problem.carried}
    return Model(TetMesh(problem.nodes, problem.tetrahedra), {0: material}, {0: "organ"}, sets)


def _solve(problem: Problem, model: Model) -> Solution:
    lift = Stage("lift", ContactLaw(), fixed=("clamped",), moves=(Move("carried", (0.0, 0.0, LIFT_MM)),))
    # The solver takes gravity and carried nodes to their goal together, in four load steps.
    scenario = Scenario((), (lift,), surgery_gravity=np.array([0.0, 0.0, -1.0]), rest_shape="as-scanned")
    settings = {"element": "T4" if problem.order == 1 else "T10", "tolerance": TOLERANCE}
    solved = make_technique("solver", "quasi-static", settings, "the benchmark").solve(model, scenario)
    if not solved.status.is_good:
        raise Failed(solved.message)
    # Each load step begins with a first-order answer, which is one more linear solve.
    return Solution(solved.displacement, sum(step.iterations + 1 for step in solved.record))


if __name__ == "__main__":
    run(glisson.__version__, _read, _solve)
