"""An operating room as far as crosses and trocars are concerned."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray, frozen_floats, unit_vector
from glisson.core.errors import BadInput
from glisson.core.transform import RigidTransform


@dataclass(frozen=True, eq=False)
class HangingArea:
    """A rectangle on a wall or the ceiling where crosses may hang.

    Args:
        name: as people call it.
        centre_mm: its middle (3,) in the room.
        right: unit vector (3,) to the right as one looks at it.
        down: unit vector (3,) downwards as one looks at it.
        width_mm: along `right`.
        height_mm: along `down`.
    """

    name: str
    centre_mm: FloatArray
    right: FloatArray
    down: FloatArray
    width_mm: float
    height_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_mm", frozen_floats(self.centre_mm, (3,), f"middle of {self.name!r}"))
        object.__setattr__(self, "right", unit_vector(self.right, f"right of {self.name!r}"))
        object.__setattr__(self, "down", unit_vector(self.down, f"down of {self.name!r}"))
        if abs(float(self.right @ self.down)) > 1e-6:
            raise BadInput(f"right and down of the area {self.name!r} must be perpendicular.")
        if not (min(self.width_mm, self.height_mm) > 0.0 and max(self.width_mm, self.height_mm) < np.inf):
            raise BadInput(f"The area {self.name!r} needs a positive width and height.")


@dataclass(frozen=True, eq=False)
class Room:
    """A box with its floor's middle at the origin and z up, mm.

    Args:
        size_mm: its length along x, width along y and height (3,).
        areas: where crosses may hang.
        trocar_low_mm: least coordinates (3,) of where the trocar may be.
        trocar_high_mm: largest ones (3,).
        tilt_rad: the trocar's axis is at most this far from upright.
    """

    size_mm: FloatArray
    areas: tuple[HangingArea, ...]
    trocar_low_mm: FloatArray
    trocar_high_mm: FloatArray
    tilt_rad: float

    def __post_init__(self) -> None:
        for name in ("size_mm", "trocar_low_mm", "trocar_high_mm"):
            object.__setattr__(self, name, frozen_floats(getattr(self, name), (3,), name))
        if not self.areas:
            raise BadInput("The room has no area where crosses may hang.")
        for area in self.areas:
            if np.cross(area.right, area.down) @ (area.centre_mm - [0.0, 0.0, self.size_mm[2] / 2.0]) <= 0.0:
                raise BadInput(f"The area {area.name!r} faces outwards; turn its right or its down round.")
        half = self.size_mm / 2.0 * [1.0, 1.0, 2.0]
        low, high = half * [-1.0, -1.0, 0.0], half
        if not (low < self.trocar_low_mm).all() or not (self.trocar_high_mm < high).all():
            raise BadInput("The trocar's region must lie within the room.")
        if not (self.trocar_low_mm <= self.trocar_high_mm).all():
            raise BadInput("The trocar's region has a least coordinate above the largest.")
        if not 0.0 <= self.tilt_rad < np.pi / 2.0:
            raise BadInput("The trocar's tilt must lie between 0° and 90°.")

    def draw_pose(self, rng: np.random.Generator) -> RigidTransform:
        """A pose `room_from_trocar`: anywhere in the region, the axis anywhere within the tilt, any roll."""
        lean = np.arccos(rng.uniform(np.cos(self.tilt_rad), 1.0))
        direction, roll = rng.uniform(0.0, 2.0 * np.pi, 2)
        rotation = Rotation.from_euler("ZYZ", [direction, lean, roll]).as_matrix()
        return RigidTransform("room", "trocar", rotation, rng.uniform(self.trocar_low_mm, self.trocar_high_mm))
