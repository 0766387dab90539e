"""Forces on a patch of the surface that vary smoothly over it: what a tool may do that holds it somewhere."""

import numpy as np
from scipy.linalg import eigh
from scipy.spatial.distance import cdist

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.geometry.quadratic import straight_boundary
from glisson.geometry.spreading import evenly_spread

_LEAST = 1e-3  # variance of a field, as a share of the first one's
_CENTRES = 500


def smooth_forces(mesh: TetMesh, nodes: IntArray, length_mm: float, most: int) -> FloatArray:
    """Shares (k, b) of the forces on the `nodes` (k,) in up to `most` fields, the strongest first.

    Amounts of unit variance along each axis make a random traction whose covariance falls with the distance as a
    Gaussian of standard deviation `length_mm` (Karhunen–Loève, by Nyström on a large patch); forces are traction times
    area. The first field has the variance 1 in all.

    Raises:
        BadInput: there is no triangle between the nodes.
    """
    places = mesh.nodes[nodes]
    centres = places[evenly_spread(places, _CENTRES)]
    values, vectors = eigh(_alike(centres, centres, length_mm))
    values, vectors = values[::-1][:most], vectors[:, ::-1][:, :most]
    kept = values > _LEAST * values[0]
    tractions = _alike(places, centres, length_mm) @ (vectors[:, kept] / np.sqrt(values[kept]))
    shares = _areas(mesh, nodes)[:, None] * tractions
    scaled: FloatArray = shares / np.linalg.norm(shares[:, 0])
    return scaled


def _alike(places: FloatArray, others: FloatArray, length_mm: float) -> FloatArray:
    """Covariance (n, m) of tractions at places (n, 3) and others (m, 3)."""
    covariance: FloatArray = np.exp(-0.5 * cdist(places, others, "sqeuclidean") / length_mm**2)
    return covariance


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
