"""The caudate lobe, segment 1: what lies around the vena cava between portal bifurcation and hepatic veins.

No vessel borders it on the right (Couinaud's segment 9 was given up for that), so it is an ellipsoid about the vena
cava that reaches the lobe's landmarks: left, right and front, top and bottom. Where these two are not known it reaches
from the bifurcation to the hepatic confluence.
"""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.landmarks import Landmarks
from glisson.preoperative.segments.landmarks import (
    BIFURCATION,
    CAUDATE_BOTTOM,
    CAUDATE_FRONT,
    CAUDATE_LEFT,
    CAUDATE_RIGHT,
    CAUDATE_TOP,
    CAVA,
    CONFLUENCE,
)

CAUDATE = (BIFURCATION, CONFLUENCE, CAVA, CAUDATE_LEFT, CAUDATE_RIGHT, CAUDATE_FRONT)
"""Names of the landmarks that are needed."""


def in_caudate(points_mm: FloatArray, landmarks: Landmarks) -> NDArray[np.bool_]:
    """Whether points (n, 3) in LPS mm lie in the caudate lobe.

    Raises:
        BadInput: landmarks are missing, or do not lie about the vena cava as their names say.
    """
    landmarks.require(CAUDATE)
    below, above, cava, left, right, front = (landmarks.one(name) for name in CAUDATE)
    below = landmarks.one(CAUDATE_BOTTOM) if CAUDATE_BOTTOM in landmarks.points_mm else below
    above = landmarks.one(CAUDATE_TOP) if CAUDATE_TOP in landmarks.points_mm else above
    centre = np.array([0.5 * (left[0] + right[0]), cava[1], 0.5 * (below[2] + above[2])])
    radii = np.array([0.5 * (left[0] - right[0]), cava[1] - front[1], 0.5 * (above[2] - below[2])])
    if radii.min() <= 0.0:
        raise BadInput(
            f"The caudate's landmarks are at odds: {CAUDATE_LEFT!r} must lie left of {CAUDATE_RIGHT!r}, "
            f"{CAUDATE_FRONT!r} before {CAVA!r}, and the top ({CONFLUENCE!r}) above the bottom ({BIFURCATION!r})."
        )
    inside: NDArray[np.bool_] = (((points_mm - centre) / radii) ** 2).sum(axis=1) < 1.0
    return inside
