"""What every engine's script does around its solve: `python ENGINE.py MESH OUT`.

OUT.npz gets the displacement (n, 3) in mm, OUT.json what was measured. The solve is timed whole, from the engine's mesh
to the displacement, after imports, reading the mesh, and one solve of the same problem on a tiny mesh, which compiles
and loads what is needed.
"""

import json
import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from problem import PATCH_RADIUS_MM, Problem, load_problem


@dataclass(frozen=True, eq=False)
class Solution:
    """Displacement (n, 3) in mm and the number of Newton iterations (linear solves) of all load steps."""

    displacement: NDArray[np.float64]
    iterations: int


class Failed(Exception):
    """The engine gave no solution; the text says why."""


def run(version: str, read: Callable[[Problem], Any], solve: Callable[[Problem, Any], Solution]) -> None:
    """Warm up, solve the problem of the command line, write both files; `read` makes the engine's own mesh."""
    problem, out = load_problem(Path(sys.argv[1])), Path(sys.argv[2])
    tiny = tiny_problem(problem.order)
    solve(tiny, read(tiny))
    mesh = read(problem)
    before = resident_mb()
    start = time.perf_counter()
    solution = solve(problem, mesh)
    seconds = time.perf_counter() - start
    write(out, version, solution, seconds, before, peak_mb())


def write(out: Path, version: str, solution: Solution, seconds: float, before_mb: float, peak: float) -> None:
    """Write OUT.npz and OUT.json."""
    np.savez(out.with_suffix(".npz"), displacement=solution.displacement)
    values = {
        "version": version,
        "seconds": seconds,
        "iterations": solution.iterations,
        "memory_mb": peak,
        "memory_before_mb": before_mb,
    }
    out.with_suffix(".json").write_text(json.dumps(values))


def tiny_problem(order: int) -> Problem:
    """Five cubes in a row along x, each of six tetrahedra (Kuhn), clamped at one end and carried at the other."""
    side = PATCH_RADIUS_MM
    nodes = side * np.array([(i, j, k) for i in range(6) for j in (0, 1) for k in (0, 1)], dtype=float)
    paths = [(0, 4, 6, 7), (0, 2, 3, 7), (0, 1, 5, 7), (0, 6, 2, 7), (0, 3, 1, 7), (0, 5, 4, 7)]
    tetrahedra = np.concatenate([np.array(paths) + 4 * cell for cell in range(5)])
    if order == 2:
        edges = np.sort(tetrahedra[:, [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]]].reshape(-1, 2), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        tetrahedra = np.hstack([tetrahedra, len(nodes) + inverse.reshape(-1, 6)])
        nodes = np.concatenate([nodes, nodes[unique].mean(axis=1)])
    x = nodes[:, 0]
    return Problem(nodes, tetrahedra, np.flatnonzero(x == 0.0), np.flatnonzero(x == x.max()))


def resident_mb() -> float:
    """Memory of this process now in MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def peak_mb() -> float:
    """The most memory that this process had, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
