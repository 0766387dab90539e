"""The child process in which Mmg runs: `python -m glisson.preoperative.meshing.mmg_process IN OUT`.

The C library does not listen to Ctrl-C; in a process of its own it does no harm. IN is an .npz with
`nodes` (n, 3) mm, `tetrahedra` (m, 4), `sizes_mm` (n,), `shortest_mm` and `envelope_mm`; OUT gets `nodes`
and `tetrahedra`.
"""

import sys

import numpy as np
from mmgpy import MmgMesh3D

_GRADATION = 1.6
"""Largest ratio of neighbouring edges."""


def main(source: str, target: str) -> None:
    """Read a mesh from `source`, make it as coarse as the sizes allow, write it to `target`."""
    given = np.load(source)
    mesh = MmgMesh3D(given["nodes"], given["tetrahedra"].astype(np.int32))
    sizes = given["sizes_mm"]
    if np.ptp(sizes) > 0.0:
        mesh["metric"] = sizes[:, None]
    mesh.remesh(
        hmax=float(sizes.max()),
        hmin=float(given["shortest_mm"]),
        hausd=float(given["envelope_mm"]),
        hgrad=_GRADATION,
        # Organs are smooth: edges of the lattice's cut are not to be kept as ridges.
        angle=0,
        verbose=-1,
    )
    np.savez(target, nodes=mesh.get_vertices(), tetrahedra=mesh.get_tetrahedra())


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2])
