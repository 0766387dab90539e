"""CalculiX (`ccx`, with SPOOLES) on a deck of C3D4 or C3D10: `python calculix_engine.py MESH OUT`.

Runs in Glisson's own environment, whose deck writer it uses. The displacement is taken from the restart
file, which alone has all digits.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np
from calculix_process import run_timed
from measuring import Failed, Solution, write
from problem import DENSITY_KG_M3, LIFT_MM, POISSON_RATIO, STEPS, YOUNG_MODULUS_KPA, Problem, load_problem

from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.phantom.calculix.deck import Deck, Increments

_RESIDUAL = 1e-6
_VALUES = 4  # of each node in the restart file: temperature or nothing, and the displacement


def _deck(problem: Problem) -> str:
    deck = Deck("Lifted ellipsoid: mm, kPa, mN, kg")
    deck.add_mesh(TetMesh(problem.nodes, problem.tetrahedra), "BODY")
    deck.neo_hooke("TISSUE", "EBODY", Material("neo-hookean", YOUNG_MODULUS_KPA, POISSON_RATIO, DENSITY_KG_M3))
    deck.node_set("CLAMPED", problem.clamped)
    deck.node_set("CARRIED", problem.carried)
    deck.fix("CLAMPED")
    deck.raw("*RESTART,WRITE,FREQUENCY=1")
    share = 1.0 / STEPS
    deck.begin_step(Increments(first=share, smallest=share / 64.0, largest=share))
    deck.residual(_RESIDUAL)
    deck.gravity("EBODY", np.array([0.0, 0.0, -1.0]))
    deck.raw("*BOUNDARY", "CARRIED,1,2", f"CARRIED,3,3,{LIFT_MM:.9g}")
    deck.end_step()
    return deck.text


def _displacement(restart: Path, count: int) -> np.ndarray:
    """Displacements (n, 3) from a restart file: the first record of that size which holds those that are given.

    The file is of Fortran's records, each with its length in bytes before and after it.
    """
    stored = restart.read_bytes()
    place, found = 0, []
    while place < len(stored):
        length = int.from_bytes(stored[place : place + 4], "little")
        if length == 8 * _VALUES * count:
            found.append(np.frombuffer(stored, np.float64, _VALUES * count, place + 4).reshape(count, _VALUES)[:, 1:])
        place += length + 8
    for values in found:
        if np.isclose(values[:, 2].max(), LIFT_MM, atol=10.0) and np.isclose(values, 0.0).any():
            return values
    raise Failed("CalculiX's restart file has no displacements")


def _main() -> None:
    problem, out = load_problem(Path(sys.argv[1])), Path(sys.argv[2])
    with tempfile.TemporaryDirectory(dir=out.parent) as folder:
        deck = Path(folder) / "ellipsoid.inp"
        deck.write_text(_deck(problem))
        found = run_timed(deck)
        displacement = _displacement(deck.with_suffix(".rout"), len(problem.nodes))
    solution = Solution(displacement, found.iterations)
    write(out, found.version, solution, found.seconds, found.memory_before_mb, found.memory_mb)


if __name__ == "__main__":
    _main()
