"""The liver of SOFA's model reduction (Goury and Duriez 2018), at a human size, held by a patch at its thick end.

Where a quick look will do, an egg of few elements stands for it.
"""

from pathlib import Path

import numpy as np

from glisson.core.arrays import IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material, Model
from glisson.io.tetrahedra import read_tetrahedra
from glisson.mechanics.numbering import numbering
from glisson.preoperative.meshing.lattice import body_centred_lattice, inside_of_level

LONGEST_MM = 220.0
HELD, TIP = "back", "tip"
_PATCH_MM = 40.0
_EGG = np.array([0.65, 0.6])  # half widths of the egg over half its length
_SPACING = 0.22
_MATERIAL = Material("neo-hookean-log", 6.0, 0.45, 1150.0)


def sofa_liver(folder: Path) -> Model:
    """The model from `liverFine.vtu`.

    Raises:
        BadInput: the file is absent or damaged.
    """
    return liver_model(read_tetrahedra(folder / "liverFine.vtu"))


def egg() -> Model:
    """An egg with one end thicker than the other, of about 2,000 elements."""
    reach = np.array([1.0, *_EGG]) + _SPACING
    nodes, lattice = body_centred_lattice(-reach, reach, _SPACING)
    widening = 1.0 - 0.3 * nodes[:, :1]  # thin towards +x
    level = np.sum((nodes / np.hstack([np.ones_like(widening), widening * _EGG])) ** 2, axis=1) - 1.0
    nodes, tetrahedra = inside_of_level(nodes, lattice, level)
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    return liver_model(TetMesh(nodes[used], tetrahedra.reshape(-1, 4)))


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
