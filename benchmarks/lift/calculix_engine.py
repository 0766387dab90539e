"""CalculiX (`ccx`, with SPOOLES) and its own face-to-face penalty contact: `python calculix_engine.py MESH OUT`.

It starts from the unloaded shape, and lies down on the board before it is lifted. It has no cohesion: see
`glisson.phantom.calculix.lift_deck`. The displacement is that of its results file, which has six digits.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from calculix_process import run_timed
from measuring import Solution, write
from problem import LIVER, load_problem, scenario

from glisson.core.mesh import TetMesh
from glisson.core.tools import Lever
from glisson.phantom.calculix.lift_deck import LiftOrgan, LiftSettings, write_lift_deck
from glisson.phantom.calculix.results import read_frd
from glisson.phantom.lever_lift import FRICTION, LEVER_ANGLE_DEG


def _main(problem_path: Path, out: Path) -> None:
    problem = load_problem(problem_path)
    moduli = np.full(len(problem.tetrahedra), LIVER.young_modulus_kpa)
    mesh = TetMesh(problem.unloaded, problem.tetrahedra)
    # CalculiX weighs the unloaded shape, Glisson the scanned one.
    density = LIVER.density_kg_m3 * TetMesh(problem.scanned, problem.tetrahedra).volume_mm3 / mesh.volume_mm3
    organ = LiftOrgan(mesh, moduli, LIVER.poisson_ratio, density, problem.held)
    lever = next(tool for tool in scenario().tools if isinstance(tool, Lever))
    with tempfile.TemporaryDirectory(dir=out.parent) as folder:
        deck = Path(folder) / "lift.inp"
        steps = write_lift_deck(deck, organ, lever, LiftSettings(LEVER_ANGLE_DEG, FRICTION))
        found = run_timed(deck)
        fields = read_frd(deck.with_suffix(".frd"))
    settled = next(field.values for field in reversed(fields) if round(field.time) == steps.stage2)
    displacement = problem.unloaded + settled[: len(problem.unloaded)] - problem.scanned
    solution = Solution(displacement, found.iterations)
    write(out, found.version, solution, found.seconds, found.memory_before_mb, found.memory_mb)


if __name__ == "__main__":
    _main(Path(sys.argv[1]), Path(sys.argv[2]))
