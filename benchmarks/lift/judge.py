"""The neutral judge: `python judge.py MESH OUT DISPLACEMENT…` writes a JSON list with an entry for each.

Where no tool and no attachment can touch, inside the organ, elastic forces must balance the weight, whatever an
engine's contact; that is the residual. An answer with an inverted element has none. Tissue has its weight as scanned.
"""

import json
import sys
from pathlib import Path

import numpy as np
from law import Tissue, forces
from numpy.typing import NDArray
from problem import LIVER, Problem, load_problem

from glisson.core.units import STANDARD_GRAVITY_MM_S2, density_from_kg_m3

_WEIGHT = density_from_kg_m3(LIVER.density_kg_m3) * STANDARD_GRAVITY_MM_S2
TISSUE = Tissue(LIVER.shear_modulus_kpa, LIVER.bulk_modulus_kpa, np.array([0.0, _WEIGHT, 0.0]))


def judge(problem: Problem, fields: list[NDArray[np.float64]]) -> list[dict[str, float | int | None]]:
    """Of each displacement from A its residual, the tumour's motion, and how far (mm) the first field puts it."""
    motions = [field[problem.watched].mean(axis=0) for field in fields]
    inside = np.zeros(len(problem.scanned), dtype=bool)
    inside[problem.inside] = True
    found = []
    for field, motion in zip(fields, motions, strict=True):
        displacement = problem.scanned + field - problem.unloaded
        pushed = forces(TISSUE, problem.unloaded, problem.tetrahedra, displacement, problem.scanned)
        found.append(
            {
                "dofs": 3 * len(problem.scanned),
                "residual": pushed.residual(inside) if pushed.least_volume_ratio > 0.0 else None,
                "moved_mm": float(np.linalg.norm(motion)),
                "difference": float(np.linalg.norm(motion - motions[0])),
            }
        )
    return found


if __name__ == "__main__":
    displacements = [np.load(name)["displacement"] for name in sys.argv[3:]]
    Path(sys.argv[2]).write_text(json.dumps(judge(load_problem(Path(sys.argv[1])), displacements)))
