"""How far poses are turned against each other, and about how many axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray


@dataclass(frozen=True)
class Turning:
    """Root mean square angles in degrees between pairs of poses, about the main axis and about the next one."""

    about_first_deg: float
    about_second_deg: float


def turning(rotations: Sequence[FloatArray]) -> Turning:
    """The turning of some rotations (3, 3).

    The axes are those of the bodies: where all poses are turned about one line, the second angle is zero.
    """
    first, second = np.triu_indices(len(rotations), 1)
    stacked = Rotation.from_matrix(np.stack(list(rotations)))
    vectors = (stacked[first].inv() * stacked[second]).as_rotvec()
    sizes = np.linalg.svd(vectors, compute_uv=False) / np.sqrt(len(vectors))
    angles = np.degrees(np.concatenate([sizes, np.zeros(2)]))
    return Turning(float(angles[0]), float(angles[1]))
