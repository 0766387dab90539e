"""A trocar with a camera in a ring about its channel; the frame "trocar" is that of the camera."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, frozen_floats, unit_vector
from glisson.core.camera import Camera
from glisson.core.errors import BadInput


@dataclass(frozen=True, eq=False)
class Trocar:
    """What does not change while the trocar moves (mm, frame "trocar").

    Args:
        camera: looks out of the patient, at the handles.
        pivot_mm: the point (3,) of the channel through which the axis of any instrument passes.
        axis: the channel's direction (3,) out of the patient.
        play_mm: standard deviation, in each direction, of an instrument's axis from the pivot.
    """

    camera: Camera
    pivot_mm: FloatArray
    axis: FloatArray
    play_mm: float = 0.5

    def __post_init__(self) -> None:
        object.__setattr__(self, "pivot_mm", frozen_floats(self.pivot_mm, (3,), "trocar pivot"))
        object.__setattr__(self, "axis", unit_vector(self.axis, "trocar axis"))
        if not (np.isfinite(self.play_mm) and self.play_mm > 0.0):
            raise BadInput(f"A trocar's play must be more than 0 mm, not {self.play_mm} mm.")
