"""Names the rigid motions that nothing observed holds."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.units import place_text
from glisson.mechanics.registration.fitting import Fit

_LOOSE_MM = 20.0
"""A motion whose standard deviation is larger is not determined."""


def unheld_motions(found: Fit, middle_mm: FloatArray, radius_mm: float) -> tuple[str, ...]:
    """Sentences on the free rigid motions of a fit.

    Args:
        found: the fit.
        middle_mm: about which the organ turns (3,), in the frame of the observations.
        radius_mm: by which turns were made lengths.
    """
    data, prior = found.data, found.prior
    inner = data[6:, 6:] + prior[6:, 6:]
    information = data[:6, :6]
    if len(inner):
        information = information - data[:6, 6:] @ np.linalg.solve(inner, data[6:, :6])
    values, vectors = np.linalg.eigh(0.5 * (information + information.T))
    loose = vectors[:, values < 1.0 / _LOOSE_MM**2].T
    return tuple(_sentence(motion[:3] / radius_mm, motion[3:], middle_mm) for motion in loose)


def _sentence(turn: FloatArray, shift: FloatArray, middle_mm: FloatArray) -> str:
    """A motion (turn in rad, shift of the middle in mm) in words."""
    size = float(np.linalg.norm(turn))
    along = turn * float(turn @ shift) / max(size, 1e-12) ** 2
    if size * 50.0 < float(np.linalg.norm(shift)) or np.linalg.norm(along) > 0.5 * np.linalg.norm(shift) > 50.0 * size:
        return f"nothing holds the motion along {_vector(shift)}"
    axis = middle_mm + np.cross(turn, shift) / max(size, 1e-12) ** 2
    return f"nothing holds the rotation about an axis along {_vector(turn)} through {place_text(axis)}"


def _vector(vector: FloatArray) -> str:
    unit = vector / np.linalg.norm(vector)
    return "(" + ", ".join(f"{component:+.2f}" for component in unit) + ")"
