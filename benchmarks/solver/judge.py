"""The neutral judge: `python judge.py MESH OUT DISPLACEMENT…` writes a JSON list with an entry for each."""

import json
import sys
from pathlib import Path

import numpy as np
from law import Tissue, forces
from numpy.typing import NDArray
from problem import BULK_KPA, SHEAR_KPA, WEIGHT_MN_MM3, Problem, load_problem

TISSUE = Tissue(SHEAR_KPA, BULK_KPA, np.array([0.0, 0.0, -WEIGHT_MN_MM3]))


def residual(problem: Problem, displacement: NDArray[np.float64]) -> float:
    """Norm of the unbalanced forces on the free nodes over the larger of the norms of internal and external forces."""
    found = forces(TISSUE, problem.nodes, problem.tetrahedra, displacement, problem.nodes)
    return found.residual(problem.free)


def relative_difference(displacement: NDArray[np.float64], reference: NDArray[np.float64]) -> float:
    """‖u − u_ref‖ / ‖u_ref‖ over all nodes."""
    return float(np.linalg.norm(displacement - reference) / np.linalg.norm(reference))


def judge(problem: Problem, fields: list[NDArray[np.float64]]) -> list[dict[str, float | int | None]]:
    """Of each displacement its unknowns, its residual, and its difference to the one with the smallest residual."""
    finite = [bool(np.isfinite(field).all()) for field in fields]
    residuals = [residual(problem, field) if known else np.inf for field, known in zip(fields, finite, strict=True)]
    best = fields[int(np.argmin(residuals))]
    return [
        {
            "dofs": 3 * int(problem.free.sum()),
            "residual": value if known else None,
            "difference": relative_difference(field, best) if known else None,
        }
        for field, known, value in zip(fields, finite, residuals, strict=True)
    ]


if __name__ == "__main__":
    displacements = [np.load(name)["displacement"] for name in sys.argv[3:]]
    Path(sys.argv[2]).write_text(json.dumps(judge(load_problem(Path(sys.argv[1])), displacements)))
