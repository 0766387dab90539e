"""Names the motion that nothing resists, for bodies that are not held firmly."""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.units import place_text
from glisson.mechanics.body import Body

_HELD_SHARE = 1e-6  # of the body's own stiffness; below it a motion counts as free

_AXES = (
    (np.array([1.0, 0.0, 0.0]), "towards the patient's left (+x)"),
    (np.array([-1.0, 0.0, 0.0]), "towards the patient's right (−x)"),
    (np.array([0.0, 1.0, 0.0]), "backwards (+y)"),
    (np.array([0.0, -1.0, 0.0]), "forwards (−y)"),
    (np.array([0.0, 0.0, 1.0]), "towards the head (+z)"),
    (np.array([0.0, 0.0, -1.0]), "towards the feet (−z)"),
)


@dataclass(frozen=True, eq=False)
class FreeMotion:
    """A rigid motion without resistance: direction of the centroid's motion (3,) and turn axis (3,).

    `part_mm` is the place (3,) in the scanned shape of the part that moves so, None where the organ is one part.
    """

    direction: FloatArray
    turn: FloatArray
    is_turn: bool
    part_mm: FloatArray | None = None

    @property
    def sentence(self) -> str:
        """What a person should read."""
        vector = self.turn if self.is_turn else self.direction
        components = ", ".join(f"{component:+.2f}" for component in vector)
        what = "the organ"
        if self.part_mm is not None:
            what = f"the part of the mesh around {place_text(self.part_mm)} hangs together with no other and"
        if self.is_turn:
            return f"{what} is not held against turning about ({components})"
        nearest, words = max(_AXES, key=lambda axis: float(axis[0] @ vector))
        described = f" {words}" if float(nearest @ vector) > 0.95 else ""
        return f"{what} is not held against sliding along ({components}){described}"


def find_free_motion(body: Body, positions: FloatArray) -> FreeMotion | None:
    """The unbalanced rigid motion of least stiffness of a part that nothing fixes; None where all are resisted.

    The stiffness is projected on the part's six rigid motions about its centroid, scaled so that a unit turn
    moves the part's edge by about a unit. A motion is free when its stiffness is below `_HELD_SHARE` of
    the whole matrix's mean diagonal times the number of nodes, or negative.
    """
    parts = _parts(body.elasticity.mesh)
    loose = [nodes for nodes in parts if not bool(body.fixed[nodes].any())]
    if not loose:
        return None
    touches = body.touches(positions, update_friction=False)
    blocks = body.stiffness(positions, touches, project=True)
    matrix, diagonal = body.matrix(blocks), float(np.abs(np.einsum("bii->b", blocks)).mean())
    unbalanced = body.balance(positions, touches).unbalanced.ravel()
    for nodes in loose:
        modes = _rigid_modes(positions, nodes)
        stiffness = modes @ (matrix @ modes.T)
        values, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
        free = values < _HELD_SHARE * diagonal * len(nodes)
        if not free.any():
            continue
        motion = vectors[:, free] @ (vectors[:, free].T @ (modes @ unbalanced))
        if not np.any(motion):
            motion = vectors[:, 0]
        motion /= np.linalg.norm(motion)
        shift, turn = motion[:3], motion[3:]
        is_turn = bool(np.linalg.norm(turn) > np.linalg.norm(shift))
        place = body.elasticity.mesh.nodes[nodes].mean(axis=0) if len(parts) > 1 else None
        return FreeMotion(_unit(shift), _unit(turn), is_turn, place)
    return None


def _parts(mesh: TetMesh) -> list[IntArray]:
    """Numbers (k,) of the nodes of each part that hangs together."""
    first, others = mesh.tetrahedra[:, :1], mesh.tetrahedra[:, 1:]
    rows, columns = np.broadcast_to(first, others.shape).ravel(), others.ravel()
    graph = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(mesh.nodes),) * 2)
    count, labels = connected_components(graph, directed=False)
    return [np.flatnonzero(labels == number) for number in range(count)]


def _rigid_modes(positions: FloatArray, nodes: IntArray) -> FloatArray:
    """Shifts and turns (6, 3 n) of some nodes (k,), in which no other one moves."""
    arms = positions[nodes] - positions[nodes].mean(axis=0)
    reach = float(np.sqrt((arms**2).sum(axis=1).mean()))
    modes = np.zeros((6, *positions.shape))
    for number, axis in enumerate(np.eye(3)):
        modes[number, nodes] = axis
        modes[3 + number, nodes] = np.cross(axis, arms) / reach
    return modes.reshape(6, -1)


def _unit(vector: FloatArray) -> FloatArray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector
