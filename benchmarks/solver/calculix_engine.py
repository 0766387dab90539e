"""CalculiX (`ccx`, with SPOOLES) on a deck of C3D4 or C3D10: `python calculix_engine.py MESH OUT`.

Runs in Glisson's own environment, whose deck writer it uses. Timed from the message with which CalculiX begins its
first step, after it has read the deck. The displacement is taken from the restart file, which alone has all digits.
"""

import os
import pty
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from adapter import Failed, Solution, write
from problem import DENSITY_KG_M3, LIFT_MM, POISSON_RATIO, STEPS, YOUNG_MODULUS_KPA, Problem, load_problem

from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.phantom.calculix.deck import Deck, Increments

_RESIDUAL = 1e-6
_BEGIN = re.compile(rb"^ *STEP +1\s*$", re.MULTILINE)
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


def _run(deck: Path) -> tuple[str, float, float, float]:
    """What CalculiX says, seconds of its solve, and its memory in MB before that and at most."""
    # On a terminal its messages come line by line.
    leader, follower = pty.openpty()
    threads = {"OMP_NUM_THREADS": str(os.cpu_count())}
    said, start, before, peak = b"", 0.0, 0.0, 0.0
    with subprocess.Popen(
        ["ccx", "-i", deck.stem], cwd=deck.parent, stdout=follower, stderr=follower, env={**os.environ, **threads}
    ) as process:
        os.close(follower)
        while chunk := _read(leader):
            said += chunk
            now, peak = _memory_mb(process.pid, (0.0, peak))
            if not start and _BEGIN.search(said):
                start, before = time.perf_counter(), now
    seconds = time.perf_counter() - start
    text = said.decode(errors="replace")
    if process.returncode != 0 or "Job finished" not in text:
        raise Failed(f"ccx ended with {process.returncode}: {' '.join(text.split()[-30:])}")
    return text, seconds, before, peak


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 1 << 16)
    except OSError:  # the other end is closed
        return b""


def _memory_mb(pid: int, otherwise: tuple[float, float]) -> tuple[float, float]:
    """Memory of a process now and at most so far; of one that has ended nothing is known any more."""
    found = dict(re.findall(r"Vm(RSS|HWM):\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text()))
    return (int(found["RSS"]) * 1024 / 1e6, int(found["HWM"]) * 1024 / 1e6) if found else otherwise


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
        text, seconds, before, peak = _run(deck)
        displacement = _displacement(deck.with_suffix(".rout"), len(problem.nodes))
    version = re.search(r"CalculiX Version ([\d.]+)", text)
    iterations = len(re.findall(r"^ *iteration +\d+", text, re.MULTILINE))
    write(out, version[1] if version else "", Solution(displacement, iterations), seconds, before, peak)


if __name__ == "__main__":
    _main()
