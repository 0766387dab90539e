"""The liver of SOFA's model reduction (Goury and Duriez 2018), at a human size, held by a patch at its thick end."""

from pathlib import Path

import numpy as np

from glisson.core.arrays import IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.io.tetrahedra import read_tetrahedra
from glisson.mechanics.numbering import numbering

LONGEST_MM = 220.0
HELD, TIP = "back", "tip"
_PATCH_MM = 40.0
_MATERIAL = Material("neo-hookean-log", 6.0, 0.45, 1150.0)


def sofa_liver(folder: Path) -> Model:
    """The model from `liverFine.vtu`.

    Raises:
        BadInput: the file is absent or damaged.
    """
    return liver_model(read_tetrahedra(folder / "liverFine.vtu"))


def liver_model(mesh: TetMesh) -> Model:
    """A mesh scaled so that the longest edge of its box is 220 mm, held at one end of it, with a tip at the other.

    The thick end is the one at which a slice of the mesh is wider.
    """
    sizes = np.ptp(mesh.nodes, axis=0)
    axis = int(sizes.argmax())
    mesh = TetMesh(mesh.nodes * LONGEST_MM / sizes[axis], mesh.tetrahedra)
    triangles, _ = mesh.boundary()
    surface = np.unique(triangles)
    along = mesh.nodes[surface, axis]
    first, last = int(surface[along.argmin()]), int(surface[along.argmax()])
    thick, tip = (first, last) if _girth(mesh, axis, first) > _girth(mesh, axis, last) else (last, first)
    held = surface[np.linalg.norm(mesh.nodes[surface] - mesh.nodes[thick], axis=1) < _PATCH_MM]
    model = Model(mesh, {0: _MATERIAL}, {0: "liver"}, {HELD: held, TIP: np.array([tip])})
    return numbering(mesh.nodes).model(model)


def _girth(mesh: TetMesh, axis: int, node: int) -> float:
    """How wide the slice of the mesh is that lies within a fifth of its length from a node."""
    near: IntArray = np.flatnonzero(np.abs(mesh.nodes[:, axis] - mesh.nodes[node, axis]) < 0.2 * LONGEST_MM)
    return float(np.prod(np.delete(np.ptp(mesh.nodes[near], axis=0), axis)))
