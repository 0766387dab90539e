"""Rigid tools and supports (LPS mm)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, frozen_floats, unit_vector
from glisson.core.errors import BadInput
from glisson.core.mesh import TriangleSurface


@dataclass(frozen=True, eq=False)
class Slot:
    """A rectangular opening of a board with rounded rims, `length_mm` long in the direction `along`."""

    centre_mm: FloatArray
    along: FloatArray
    length_mm: float
    width_mm: float
    edge_radius_mm: float = 2.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre_mm", frozen_floats(self.centre_mm, (3,), "slot centre"))
        object.__setattr__(self, "along", unit_vector(self.along, "slot direction"))
        sizes = (self.length_mm, self.width_mm, self.edge_radius_mm)
        if not (min(sizes) > 0.0 and max(sizes) < np.inf):
            raise BadInput(f"A slot needs positive sizes, not {sizes} mm.")


@dataclass(frozen=True, eq=False)
class Board:
    """A plane that the organ lies on; `normal` points from the board towards the organ.

    A `conforming` board is bedding or neighbouring tissue that has taken the shape of the organ's
    underside in the scan: it carries every downward-facing part of the surface where the scan shows it,
    and yields to sharp edges by a fraction of a millimetre. A `slot` lets a lever through to the organ.
    """

    name: str
    point_mm: FloatArray
    normal: FloatArray
    conforming: bool = False
    slot: Slot | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "point_mm", frozen_floats(self.point_mm, (3,), "board point"))
        object.__setattr__(self, "normal", unit_vector(self.normal, "board normal"))
        if self.slot is not None and abs(float(self.slot.along @ self.normal)) > 1e-6:
            raise BadInput(f"The slot of board {self.name!r} must run along the board.")

    def carries(self, points_mm: FloatArray) -> NDArray[np.bool_]:
        """Whether points (n, 3) lie over the board's face, not over its slot or the slot's rounded rim, (n,)."""
        if self.slot is None:
            return np.ones(len(points_mm), dtype=bool)
        away = np.asarray(points_mm) - self.slot.centre_mm
        across = np.cross(self.normal, self.slot.along)
        rim = self.slot.edge_radius_mm
        beyond: NDArray[np.bool_] = np.abs(away @ self.slot.along) >= 0.5 * self.slot.length_mm + rim
        return beyond | (np.abs(away @ across) >= 0.5 * self.slot.width_mm + rim)


@dataclass(frozen=True, eq=False)
class Lever:
    """A rigid bar with rounded edges on a hinge: the wooden lever of the dissertation's chapter 4.

    At angle 0 the bar starts at `hinge_mm` and runs `length_mm` along `arm`; it is `width_mm` wide along
    `axis` (centred on the hinge) and its top face contains the hinge, the bar lying `thickness_mm` below
    it. A positive angle turns the bar about `axis` by the right-hand rule, which moves the tip towards
    `up` = axis × arm; `Lever.lifting` chooses the axis from the direction that is up.
    """

    name: str
    hinge_mm: FloatArray
    axis: FloatArray
    arm: FloatArray
    length_mm: float = 150.0
    width_mm: float = 25.0
    thickness_mm: float = 8.0
    edge_radius_mm: float = 3.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "hinge_mm", frozen_floats(self.hinge_mm, (3,), "lever hinge"))
        object.__setattr__(self, "axis", unit_vector(self.axis, "lever axis"))
        object.__setattr__(self, "arm", unit_vector(self.arm, "lever arm"))
        if abs(float(self.axis @ self.arm)) > 1e-6:
            raise BadInput("The lever's axis and arm must be perpendicular.")
        sizes = (self.length_mm, self.width_mm, self.thickness_mm)
        sound = np.isfinite(sizes).all() and min(sizes) > 0.0
        if not sound or not 0.0 < self.edge_radius_mm <= min(sizes) / 2.0:
            raise BadInput(
                f"Lever {self.name!r} needs positive sizes and an edge radius of at most half its "
                f"smallest one, not {sizes} mm and {self.edge_radius_mm} mm."
            )

    @property
    def up(self) -> FloatArray:
        """Unit normal of the top face at angle 0, the side that touches the organ: axis × arm."""
        return np.cross(self.axis, self.arm)

    @classmethod
    def lifting(cls, name: str, hinge_mm: FloatArray, arm: FloatArray, up: FloatArray, **sizes: float) -> "Lever":
        """A lever whose positive angle moves its tip from `arm` towards `up`."""
        direction = unit_vector(arm, "lever arm")
        upward = np.asarray(up, dtype=np.float64)
        return cls(name, hinge_mm, np.cross(direction, upward), direction, **sizes)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A rigid bar with round ends, as a grasper's jaw or shaft: all within `radius_mm` of a line; stages carry it."""

    name: str
    start_mm: FloatArray
    end_mm: FloatArray
    radius_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "start_mm", frozen_floats(self.start_mm, (3,), "cylinder start"))
        object.__setattr__(self, "end_mm", frozen_floats(self.end_mm, (3,), "cylinder end"))
        if not 0.0 < self.radius_mm < np.inf or bool(np.all(self.start_mm == self.end_mm)):
            raise BadInput(f"Cylinder {self.name!r} needs two different ends and a positive radius.")


@dataclass(frozen=True, eq=False)
class MeshTool:
    """A rigid tool of any shape: a closed surface and all within `skin_mm` of it, which rounds its edges."""

    name: str
    surface: TriangleSurface
    skin_mm: float = 1.5

    def __post_init__(self) -> None:
        if not self.surface.is_closed:
            raise BadInput(f"The surface of tool {self.name!r} is not closed; repair it first.")
        if not 0.0 < self.skin_mm < np.inf:
            raise BadInput(f"Tool {self.name!r} needs a positive skin_mm, which rounds its edges.")


Tool = Board | Lever | Cylinder | MeshTool
