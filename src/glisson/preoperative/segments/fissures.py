"""Planes through landmarks: the fissures along the hepatic veins, and the planes of the portal branches."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.landmarks import Landmarks
from glisson.core.structures import Plane
from glisson.preoperative.segments.landmarks import (
    BIFURCATION,
    CONFLUENCE,
    GALLBLADDER_FOSSA,
    LEFT_PORTAL,
    LEFT_VEIN,
    MIDDLE_VEIN,
    RIGHT_FISSURE,
    RIGHT_PORTAL,
    RIGHT_VEIN,
    UMBILICAL,
    UMBILICAL_FISSURE,
)

RIGHT, MIDDLE, LEFT = (
    (CONFLUENCE, RIGHT_VEIN, RIGHT_FISSURE),
    (CONFLUENCE, MIDDLE_VEIN, GALLBLADDER_FOSSA),
    (CONFLUENCE, LEFT_VEIN, UMBILICAL_FISSURE),
)
"""The landmarks in each fissure."""

RIGHT_ACROSS, LEFT_ACROSS = (BIFURCATION, RIGHT_PORTAL), (UMBILICAL, LEFT_PORTAL)
"""The landmarks in the plane that parts cranial from caudal segments, on either side."""

_LEFTWARD, _BACKWARD, _CRANIAL = np.eye(3)
# A right hepatic vein that runs backwards has the segments 5 and 8 before it rather than left of it.
_MEDIAL: dict[tuple[str, ...], FloatArray] = {RIGHT: np.array([0.3, -1.0, 0.0]), MIDDLE: _LEFTWARD, LEFT: _LEFTWARD}
_LEAST_SINE = 0.1


def fissure(landmarks: Landmarks, names: tuple[str, str, str], towards_right_mm: float = 0.0) -> Plane:
    """The plane through three landmarks; its normal points to the patient's left, that of the right fissure forward.

    It is moved against its normal by `towards_right_mm`.

    Raises:
        BadInput: a landmark is missing, or they lie nearly on a line.
    """
    a, b, c = _points(landmarks, names)
    normal = _normal(b - a, c - a, _MEDIAL[names], names)
    return Plane(a - towards_right_mm * normal, normal)


def portal_plane(landmarks: Landmarks, names: tuple[str, ...]) -> Plane:
    """The plane through two landmarks that holds the anteroposterior axis; its normal points to the head.

    Raises:
        BadInput: a landmark is missing, or they lie one before the other.
    """
    a, b = _points(landmarks, names)
    return Plane(a, _normal(b - a, _BACKWARD, _CRANIAL, names))


def _points(landmarks: Landmarks, names: tuple[str, ...]) -> list[FloatArray]:
    landmarks.require(names)
    return [landmarks.one(name) for name in names]


def _normal(one: FloatArray, other: FloatArray, side: FloatArray, names: tuple[str, ...]) -> FloatArray:
    """Unit normal (3,) of two directions, on the given side."""
    normal: FloatArray = np.cross(one, other)
    size = float(np.linalg.norm(normal))
    if size <= _LEAST_SINE * float(np.linalg.norm(one) * np.linalg.norm(other)):
        raise BadInput(f"The landmarks {', '.join(map(repr, names))} span no plane; set them farther apart.")
    return normal / size if normal @ side > 0.0 else -normal / size
