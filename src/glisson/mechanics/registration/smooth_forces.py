"""Forces on a patch of the surface that vary smoothly over it: what a tool may do that holds it somewhere."""

import numpy as np
from scipy.linalg import eigh

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.geometry.quadratic import straight_boundary

_LEAST = 1e-3  # variance of a field, as a share of the first one's


def smooth_forces(mesh: TetMesh, nodes: IntArray, length_mm: float, most: int) -> FloatArray:
    """Shares (k, b) of the forces on the `nodes` (k,) in up to `most` fields, the strongest first.

    Amounts of unit variance along each axis make a random traction whose covariance falls with the distance as a
    Gaussian of standard deviation `length_mm` (Karhunen–Loève); forces are traction times area. The first field has
    the variance 1 in all.

    Raises:
        BadInput: there is no triangle between the nodes.
    """
    places = mesh.nodes[nodes]
    apart = ((places[:, None] - places[None]) ** 2).sum(axis=2)
    areas = _areas(mesh, nodes)
    covariance = areas[:, None] * np.exp(-0.5 * apart / length_mm**2) * areas
    first = max(len(nodes) - most, 0)
    values, vectors = eigh(covariance, subset_by_index=[first, len(nodes) - 1])
    values, vectors = values[::-1], vectors[:, ::-1]
    kept = values > _LEAST * values[0]
    shares: FloatArray = vectors[:, kept] * np.sqrt(values[kept] / values[0])
    return shares


def _areas(mesh: TetMesh, nodes: IntArray) -> FloatArray:
    """A third of the area of the patch's triangles for every node (k,), in mm²."""
    triangles, _ = straight_boundary(mesh)
    triangles = triangles[np.isin(triangles, nodes).all(axis=1)]
    if len(triangles) == 0:
        raise BadInput("The nodes that forces may act on have no triangle of the surface between them.")
    corners = mesh.nodes[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    thirds = np.repeat(np.linalg.norm(normals, axis=1) / 6.0, 3)
    areas: FloatArray = np.bincount(triangles.ravel(), thirds, minlength=len(mesh.nodes)).astype(np.float64)
    return areas[nodes]
