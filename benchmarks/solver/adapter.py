"""What every engine's script does around its solve: `python ENGINE.py MESH OUT`.

The solve is timed whole, from the engine's mesh
to the displacement, after imports, reading the mesh, and one solve of the same problem on a tiny mesh, which compiles
and loads what is needed.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from measuring import Solution, peak_mb, resident_mb, write
from problem import PATCH_RADIUS_MM, Problem, load_problem


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
