"""Names the motion that nothing resists, for bodies that are not held firmly."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
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
    """A rigid motion without resistance: direction of the centroid's motion (3,) and turn axis (3,)."""

    direction: FloatArray
    turn: FloatArray
    is_turn: bool

    @property
    def sentence(self) -> str:
        """What a person should read."""
        vector = self.turn if self.is_turn else self.direction
        components = ", ".join(f"{component:+.2f}" for component in vector)
        if self.is_turn:
            return f"the organ is not held against turning about ({components})"
        nearest, words = max(_AXES, key=lambda axis: float(axis[0] @ vector))
        described = f" {words}" if float(nearest @ vector) > 0.95 else ""
        return f"the organ is not held against sliding along ({components}){described}"


def find_free_motion(body: Body, positions: FloatArray) -> FreeMotion | None:
    """The unbalanced rigid motion of least stiffness, or None where all are resisted.

    The stiffness is projected on the six rigid motions about the centroid, scaled so that a unit turn
    moves the body's edge by about a unit. A motion is free when its stiffness is below `_HELD_SHARE` of
    the whole matrix's mean diagonal times the number of nodes, or negative.
    """
    if bool(body.fixed.any()):
        return None
    touches = body.touches(positions, update_friction=False)
    blocks = body.stiffness(positions, touches, project=True)
    modes = np.reshape(_rigid_modes(positions), (6, -1))
    stiffness = modes @ (body.matrix(blocks) @ modes.T)
    values, vectors = np.linalg.eigh(0.5 * (stiffness + stiffness.T))
    scale = float(np.abs(np.einsum("bii->b", blocks)).mean()) * len(positions)
    free = values < _HELD_SHARE * scale
    if not free.any():
        return None
    unbalanced = body.balance(positions, touches).unbalanced
    push = modes @ unbalanced.ravel()
    motion = vectors[:, free] @ (vectors[:, free].T @ push)
    if not np.any(motion):
        motion = vectors[:, 0]
    motion /= np.linalg.norm(motion)
    shift, turn = motion[:3], motion[3:]
    is_turn = bool(np.linalg.norm(turn) > np.linalg.norm(shift))
    return FreeMotion(_unit(shift), _unit(turn), is_turn)


def _rigid_modes(positions: FloatArray) -> list[FloatArray]:
    arms = positions - positions.mean(axis=0)
    reach = float(np.sqrt((arms**2).sum(axis=1).mean()))
    shifts = [np.tile(axis, (len(positions), 1)) for axis in np.eye(3)]
    return shifts + [np.cross(axis, arms) / reach for axis in np.eye(3)]


def _unit(vector: FloatArray) -> FloatArray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > 0.0 else vector
