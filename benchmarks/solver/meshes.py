"""Meshes of the benchmark: `python meshes.py ELEMENTS ELEMENT OUT`, for example `19482 T4 mesh.npz`.

A body-centred cubic lattice is cut at the ellipsoid's surface, whose nodes are then moved onto it. Spacing and place of
the lattice were chosen once, so that the counts are near round figures; nothing is random. T10 has the
same elements with straight edges.
"""

import sys
from pathlib import Path

import numpy as np
from problem import CLAMPED_BELOW_X_MM, PATCH_RADIUS_MM, SEMI_AXES_MM

from glisson.core.mesh import TET_EDGES, TetMesh
from glisson.io.atomic import atomic_path
from glisson.preoperative.meshing.lattice import body_centred_lattice, inside_of_level

LATTICES = {
    8_057: (13.528, 0.29),
    19_482: (9.987, 0.42),
    64_003: (6.657, 0.47),
    240_565: (4.248, 0.35),
    992_446: (2.633, 0.35),
}
"""Number of elements → spacing in mm and shift as a share of it."""


def ellipsoid_mesh(spacing: float, shift: float) -> TetMesh:
    """T4 mesh of the ellipsoid from a lattice of this spacing in mm, moved by `shift` of it along each axis."""
    reach = SEMI_AXES_MM + spacing
    offset = spacing * shift * np.array([1.0, 0.7, 0.4])
    nodes, lattice = body_centred_lattice(-reach, reach, spacing)
    nodes = nodes + offset
    nodes, tetrahedra = inside_of_level(nodes, lattice, _radius(nodes) - 1.0)
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    nodes = nodes[used]
    mesh = TetMesh(nodes, tetrahedra.reshape(-1, 4))
    on_surface = np.unique(mesh.boundary()[0])
    nodes[on_surface] /= _radius(nodes[on_surface])[:, None]
    return TetMesh(nodes, mesh.tetrahedra)


def _radius(points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(points / SEMI_AXES_MM, axis=1)


def held_nodes(mesh: TetMesh) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the clamped and the carried nodes of a T4 mesh."""
    surface = np.unique(mesh.boundary()[0])
    places = mesh.nodes[surface]
    tip = np.linalg.norm(places - [SEMI_AXES_MM[0], 0.0, 0.0], axis=1) <= PATCH_RADIUS_MM
    return surface[places[:, 0] < CLAMPED_BELOW_X_MM], surface[tip]


def with_middles(mesh: TetMesh, chosen: np.ndarray) -> np.ndarray:
    """Chosen corner nodes of a T10 mesh, and the middle nodes between two of them."""
    inside = np.zeros(len(mesh.nodes), dtype=bool)
    inside[chosen] = True
    both = inside[mesh.corners[:, TET_EDGES]].all(axis=2)
    inside[mesh.tetrahedra[:, 4:][both]] = True
    return np.flatnonzero(inside)


def main(elements: int, element: str, target: Path) -> None:
    """Make one mesh and write it."""
    mesh = ellipsoid_mesh(*LATTICES[elements])
    if len(mesh.tetrahedra) != elements:
        raise SystemExit(f"The lattice gives {len(mesh.tetrahedra)} elements here, not {elements}.")
    clamped, carried = held_nodes(mesh)
    if element == "T10":
        mesh = mesh.as_quadratic()
        clamped, carried = with_middles(mesh, clamped), with_middles(mesh, carried)
    with atomic_path(target) as path:
        np.savez(path, nodes=mesh.nodes, tetrahedra=mesh.tetrahedra, clamped=clamped, carried=carried)


if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2], Path(sys.argv[3]))
