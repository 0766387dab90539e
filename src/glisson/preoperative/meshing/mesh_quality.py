"""How good a tetrahedral mesh is: dihedral angles, edges, volume, connectedness."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_EDGES, TET_FACES, TetMesh


@dataclass(frozen=True)
class MeshQuality:
    """Figures of a mesh by its straight corners: angles in degrees, lengths in mm, volume in ml.

    `smallest_dihedral_deg` is the worst angle of the mesh, `median_dihedral_deg` the median over the
    elements of each one's smallest (70.5° for a regular tetrahedron). At `pinched_edges` the mesh touches
    itself: more than two triangles of its boundary meet there, as at the bottom of a tight fissure.
    """

    elements: int
    nodes: int
    volume_ml: float
    smallest_dihedral_deg: float
    median_dihedral_deg: float
    shortest_edge_mm: float
    median_edge_mm: float
    longest_edge_mm: float
    smallest_volume_mm3: float
    pinched_edges: int


def mesh_quality(mesh: TetMesh) -> MeshQuality:
    """Quality of a T4 or T10 mesh (the corners of T10)."""
    angles = smallest_dihedral_angles_deg(mesh.nodes, mesh.corners)
    edges = np.unique(np.sort(mesh.corners[:, TET_EDGES].reshape(-1, 2), axis=1), axis=0)
    lengths = np.linalg.norm(mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]], axis=1)
    return MeshQuality(
        elements=len(mesh.tetrahedra),
        nodes=len(mesh.nodes),
        volume_ml=mesh.volume_mm3 * 1e-3,
        smallest_dihedral_deg=float(angles.min()),
        median_dihedral_deg=float(np.median(angles)),
        shortest_edge_mm=float(lengths.min()),
        median_edge_mm=float(np.median(lengths)),
        longest_edge_mm=float(lengths.max()),
        smallest_volume_mm3=float(mesh.corner_volumes_mm3.min()),
        pinched_edges=_pinched_edges(mesh),
    )


def _pinched_edges(mesh: TetMesh) -> int:
    triangles, _ = mesh.boundary()
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return int((counts > 2).sum())


def smallest_dihedral_angles_deg(nodes: FloatArray, corners: IntArray) -> FloatArray:
    """Smallest of the six dihedral angles of each tetrahedron (m, 4), in degrees (m,)."""
    normals = []
    for face in TET_FACES:
        a, b, c = (nodes[corners[:, n]] for n in face)
        normal = np.cross(b - a, c - a)
        normals.append(normal / np.linalg.norm(normal, axis=1, keepdims=True))
    # The angle between two faces is π minus the angle between their outward normals.
    cosines = [-np.einsum("ij,ij->i", normals[f], normals[g]) for f in range(4) for g in range(f)]
    angles: FloatArray = np.degrees(np.arccos(np.clip(np.max(cosines, axis=0), -1.0, 1.0)))
    return angles


def face_connected_parts(corners: IntArray) -> tuple[int, IntArray]:
    """Number of parts, and the part of each tetrahedron (m,), where elements hang together by faces.

    Parts that share only an edge or a node would move like hinges.
    """
    faces = np.sort(corners[:, TET_FACES].reshape(-1, 3), axis=1)
    _, inverse = np.unique(faces, axis=0, return_inverse=True)
    owners = np.repeat(np.arange(len(corners)), 4)
    order = np.argsort(inverse, kind="stable")
    same = np.flatnonzero(np.diff(inverse[order]) == 0)
    first, second = owners[order[same]], owners[order[same + 1]]
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(len(corners), len(corners)))
    count, part = connected_components(graph, directed=False)
    return int(count), part.astype(np.int64)
