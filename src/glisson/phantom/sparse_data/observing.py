"""From swabbed material points to observations: deformed, moved into the room, noisy, some of them wrong."""

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.observations import Observation, Observations
from glisson.core.transform import RigidTransform

FRONT = "anterior surface"

_EXACT_MM = 0.5
"""What a tracked stylus is said to be good for where no noise is added."""

_OFF_MM = (8.0, 30.0)
"""A wrong point: the stylus has left the organ by so much, mostly outward, where other tissue or air is."""

_SIDEWAYS_MM = 5.0
_TRACKER_MM = 400.0


def draw_room_from_patient(random: np.random.Generator) -> RigidTransform:
    """Any pose: a tracker stands anywhere and knows nothing of the scan's axes."""
    turn = Rotation.random(rng=random).as_matrix()
    return RigidTransform("room", "patient", turn, random.uniform(-_TRACKER_MM, _TRACKER_MM, size=3))


def observe(
    touched: Mapping[str, FloatArray],
    normals: Mapping[str, FloatArray],
    room_from_patient: RigidTransform,
    noise_mm: float,
    outlier_share: float,
    random: np.random.Generator,
) -> Observations:
    """What the tracker says of points that were touched, in the frame "room".

    Args:
        touched: points (n, 3) of the deformed organ, mm in the patient's frame, by the name of where they are.
        normals: outward unit normals (n, 3) there.
        room_from_patient: how the deformed organ lies.
        noise_mm: standard deviation of each coordinate.
        outlier_share: share of all points that are wrong.
        random: draws noise and outliers.
    """
    items = []
    for name, points in touched.items():
        wrong = random.permutation(len(points)) < round(outlier_share * len(points))
        off = random.uniform(*_OFF_MM, size=(len(points), 1)) * normals[name]
        off += random.normal(scale=_SIDEWAYS_MM, size=points.shape)
        noisy = points + np.where(wrong[:, None], off, 0.0) + random.normal(scale=noise_mm, size=points.shape)
        items.append(
            Observation(
                "surface" if name == FRONT else "curve",
                name,
                room_from_patient.apply(noisy),
                max(noise_mm, _EXACT_MM),
                "room",
            )
        )
    return Observations(tuple(items))
