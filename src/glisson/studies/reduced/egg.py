"""An egg that stands for the liver where a quick look will do and no data are at hand."""

import numpy as np

from glisson.core.mesh import TetMesh
from glisson.core.model import Model
from glisson.preoperative.meshing.lattice import body_centred_lattice, inside_of_level
from glisson.studies.reduced.liver import liver_model

_WIDTHS = np.array([0.65, 0.6])  # over the length
_THINNING = 0.3  # towards the tip
_SPACING = 0.15  # of the lattice, in half lengths


def egg(spacing: float = _SPACING) -> Model:
    """An egg with one end thicker than the other, of some 6,000 elements."""
    reach = np.array([1.0, *_WIDTHS]) + spacing
    nodes, lattice = body_centred_lattice(-reach, reach, spacing)
    widths = (1.0 - _THINNING * nodes[:, :1]) * _WIDTHS
    level = np.sum((nodes / np.hstack([np.ones((len(nodes), 1)), widths])) ** 2, axis=1) - 1.0
    nodes, tetrahedra = inside_of_level(nodes, lattice, level)
    used, tetrahedra = np.unique(tetrahedra, return_inverse=True)
    return liver_model(TetMesh(nodes[used], tetrahedra.reshape(-1, 4)))
