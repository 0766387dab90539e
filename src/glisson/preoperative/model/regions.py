"""Which element belongs to which tissue: the tumours' label map sampled inside the elements."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.image import LabelMap
from glisson.core.mesh import TetMesh

ORGAN = "liver"
"""Name of region 0, the organ's own tissue."""

_PER_EDGE = 4
"""Each element is sampled at the centroids of the cells of a lattice with so many steps an edge."""


def element_regions(mesh: TetMesh, tumours: LabelMap | None) -> tuple[IntArray, dict[int, str]]:
    """Region number of each element (m,), and the name of each region.

    An element belongs to a tumour that fills more than half of it, else to the organ (region 0, "liver").
    Tumour regions carry the numbers and names of the label map; a tumour smaller than an element may
    have none.
    """
    names = {0: ORGAN}
    regions = np.zeros(len(mesh.tetrahedra), dtype=np.int64)
    if tumours is None:
        return regions, names
    numbers = sorted(tumours.names)
    names |= {number: tumours.names[number] for number in numbers}
    found = _sampled_labels(mesh, tumours)
    for number in numbers:
        regions[(found == number).mean(axis=1) > 0.5] = number
    return regions, names


def _sampled_labels(mesh: TetMesh, labels: LabelMap) -> IntArray:
    """Label at each sample point of each element, (m, s); 0 outside the grid."""
    weights = _lattice_weights(_PER_EDGE)
    points = np.einsum("sc,mci->msi", weights, mesh.nodes[mesh.corners])
    indices = np.rint(labels.grid.indices_from_points(points.reshape(-1, 3))).astype(np.int64)
    inside = ((indices >= 0) & (indices < np.array(labels.grid.shape))).all(axis=1)
    values = np.zeros(len(indices), dtype=np.int64)
    i, j, k = indices[inside].T
    values[inside] = labels.voxels[i, j, k]
    return values.reshape(len(mesh.tetrahedra), len(weights))


def _lattice_weights(steps: int) -> FloatArray:
    """Barycentric coordinates (s, 4) of an even lattice inside a tetrahedron, off its faces."""
    counts = np.array(
        [(a, b, c, steps - 1 - a - b - c) for a in range(steps) for b in range(steps - a) for c in range(steps - a - b)]
    )
    weights: FloatArray = (counts + 0.25) / (steps - 1 + 4 * 0.25)
    return weights
