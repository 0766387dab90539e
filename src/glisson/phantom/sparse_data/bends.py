"""Drawn bends and twists of a liver, of the size that packing an organ makes."""

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.phantom.sparse_data.closed_form import Bend, Frame, InTurn, Twist

_CURVATURE_PER_MM = (1.0 / 620.0, 1.0 / 370.0)
_TWIST_PER_MM = (0.0006, 0.0015)
"""Sizes are tuned on livers of their own so that a rigid registration is left with 3.5 to 5 mm."""

_TILT_DEG = 20.0
"""The organ's long axis is that of the patient's sides, tilted by up to so much."""


def draw_bend(middle_mm: FloatArray, random: np.random.Generator) -> InTurn:
    """A twist about the organ's length, then a bend of it towards any side; `middle_mm` (3,) hardly moves."""
    tilt = Rotation.from_rotvec(np.radians(random.uniform(-_TILT_DEG, _TILT_DEG, size=3)))
    side = random.uniform(0.0, 2.0 * np.pi)
    length = tilt.apply([1.0, 0.0, 0.0])
    thickness = tilt.apply([0.0, np.cos(side), np.sin(side)])
    frame = Frame(np.asarray(middle_mm), np.stack([thickness, length, np.cross(thickness, length)], axis=1))
    twist = float(random.choice([-1.0, 1.0]) * random.uniform(*_TWIST_PER_MM))
    return InTurn(Twist(frame, twist), Bend(frame, 1.0 / float(random.uniform(*_CURVATURE_PER_MM))))
