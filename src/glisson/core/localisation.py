"""Where a trocar is, as told by an image of its camera."""

from dataclasses import dataclass

from glisson.core.arrays import FloatArray
from glisson.core.status import Status
from glisson.core.transform import RigidTransform


@dataclass(frozen=True, eq=False)
class Localisation:
    """A pose of the trocar's camera in the room, with its doubts; the frame "trocar" is that of the camera.

    Args:
        status: converged; ambiguous (a second pose explains the image, too); unobservable (the bounds below are too
            wide, or too little is seen for a pose); bad_input (mirrored, or crosses of another size).
        message: one sentence on it.
        room_from_trocar: the pose with covariance; None where there is none.
        second: the other pose, where the image has two.
        crosses: names of those that it rests on.
        corners_px: their corners (n, 2) as they were measured in the image.
        position_bound_mm: the position errs by more than this in one of 10,000 cases.
        angle_bound_rad: the same of its orientation.
        noise_px: standard deviation of a corner, as the residual has it.
        notes: sentences on what a person should look at.
    """

    status: Status
    message: str
    room_from_trocar: RigidTransform | None = None
    second: RigidTransform | None = None
    crosses: tuple[str, ...] = ()
    corners_px: FloatArray | None = None
    position_bound_mm: float | None = None
    angle_bound_rad: float | None = None
    noise_px: float | None = None
    notes: tuple[str, ...] = ()
