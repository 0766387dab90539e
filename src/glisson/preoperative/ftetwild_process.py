"""The child process in which fTetWild runs: `python -m glisson.preoperative.ftetwild_process IN OUT`.

The C++ library prints to stdout and does not listen to Ctrl-C; in a process of its own it can do
neither harm. IN is an .npz with `vertices` (n, 3) mm, `triangles` (m, 3), `edge_length_mm`,
`epsilon` (relative to the box's diagonal) and `stop_energy`; OUT gets `nodes` and `tetrahedra`.
"""

import sys
from types import ModuleType

import numpy as np


def main(source: str, target: str) -> None:
    """Read a surface from `source`, mesh it, write the tetrahedra to `target`."""
    # pytetwild imports pyvista, and with it VTK (566 MB), for an accessor that is never used here; an
    # empty module makes it skip the registration.
    sys.modules.setdefault("pyvista", ModuleType("pyvista"))
    from pytetwild.pytetwild import tetrahedralize

    given = np.load(source)
    nodes, tetrahedra = tetrahedralize(
        given["vertices"],
        given["triangles"].astype(np.uint32),
        edge_length_abs=float(given["edge_length_mm"]),
        epsilon=float(given["epsilon"]),
        stop_energy=float(given["stop_energy"]),
        loglevel=6,
        quiet=True,
    )
    np.savez(target, nodes=nodes, tetrahedra=tetrahedra)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
