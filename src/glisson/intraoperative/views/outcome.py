"""Points with covariance as observations in the frame "room"."""

from collections.abc import Sequence

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.observations import Observation, ObservationKind


def landmark_observations(
    names: Sequence[str], points_mm: FloatArray, covariance_mm2: FloatArray
) -> tuple[Observation, ...]:
    """One observation for each landmark."""
    return tuple(
        observation("landmark", name, points_mm[[row]], covariance_mm2[[row]]) for row, name in enumerate(names)
    )


def observation(kind: ObservationKind, name: str, points_mm: FloatArray, covariance_mm2: FloatArray) -> Observation:
    """Points (n, 3); `sigma_mm` is the root mean square over their axes."""
    even = 0.5 * (covariance_mm2 + np.swapaxes(covariance_mm2, 1, 2))
    sigma = float(np.sqrt(np.trace(even, axis1=1, axis2=2).mean() / 3.0))
    return Observation(kind, name, points_mm, sigma, "room", covariance_mm2=even)
