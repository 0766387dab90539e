"""Boxes of tetrahedra: bodies whose shape every mesh has exactly."""

from collections.abc import Sequence

import numpy as np

from glisson.core.mesh import TetMesh

# Six tetrahedra around the diagonal 0-7 of a cube whose corner c sits at (c & 1, c >> 1 & 1, c >> 2 & 1).
_CUBE = np.array([[0, 1, 3, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 6, 4, 7], [0, 4, 5, 7], [0, 5, 1, 7]])


def box_mesh(sizes: Sequence[float], counts: Sequence[int], quadratic: bool = False) -> TetMesh:
    """A box from the origin, cut in `counts` cubes of six tetrahedra each."""
    numbers = np.asarray(counts)
    axes = [np.linspace(0.0, size, count + 1) for size, count in zip(sizes, counts, strict=True)]
    nodes = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack(np.meshgrid(*[np.arange(n) for n in counts], indexing="ij"), axis=-1).reshape(-1, 3)
    strides = np.array([(numbers[1] + 1) * (numbers[2] + 1), numbers[2] + 1, 1])
    offsets = np.array([[c & 1, c >> 1 & 1, c >> 2 & 1] for c in range(8)])
    corners = (cells[:, None, :] + offsets) @ strides
    mesh = TetMesh(nodes, corners[:, _CUBE].reshape(-1, 4))
    return mesh.as_quadratic() if quadratic else mesh
