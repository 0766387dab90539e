"""Names the rigid motions that nothing observed holds."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.units import place_text

_LOOSE_MM = 20.0
"""A motion whose standard deviation is larger is not determined."""


def unheld_motions(positions: FloatArray, spread_mm: FloatArray) -> tuple[str, ...]:
    """Sentences on the rigid motions that are not determined.

    Args:
        positions: nodes (n, 3) in mm.
        spread_mm: (n, 3, k), a root of the posterior covariance of all nodes.
    """
    middle = positions.mean(axis=0)
    arms = positions - middle
    radius = float(np.sqrt((arms**2).sum(axis=1).mean()))
    turns = np.cross(np.eye(3)[:, None], arms[None]) / radius
    shifts = np.repeat(np.eye(3)[:, None], len(arms), axis=1)
    rigid = np.concatenate([turns, shifts]).reshape(6, -1).T
    amounts = np.linalg.lstsq(rigid.T @ rigid, rigid.T @ spread_mm.reshape(len(rigid), -1), rcond=None)[0]
    vectors, sigma, _ = np.linalg.svd(amounts)
    loose = vectors[:, : len(sigma)][:, sigma > _LOOSE_MM].T
    return tuple(_sentence(motion[:3] / radius, motion[3:], middle, radius) for motion in loose)


def _sentence(turn: FloatArray, shift: FloatArray, middle_mm: FloatArray, radius_mm: float) -> str:
    """A motion in words: its turn (rad) about the middle, and the shift (mm) of that."""
    size = float(np.linalg.norm(turn))
    pitch = abs(float(turn @ shift)) / max(size, 1e-12)
    if pitch > size * radius_mm or float(np.linalg.norm(shift)) > 5.0 * size * radius_mm:
        return f"nothing holds the motion along {_vector(shift)}"
    axis = middle_mm + np.cross(turn, shift) / max(size, 1e-12) ** 2
    return f"nothing holds the rotation about an axis along {_vector(turn)} through {place_text(axis)}"


def _vector(vector: FloatArray) -> str:
    unit = vector / np.linalg.norm(vector)
    return "(" + ", ".join(f"{component:+.2f}" for component in unit) + ")"
