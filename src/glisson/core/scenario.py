"""What is done to the organ, stage by stage: gravity, supports, tools, contact (LPS mm)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glisson.core.arrays import FloatArray, frozen_floats, unit_vector
from glisson.core.errors import BadInput


@dataclass(frozen=True, eq=False)
class Board:
    """A plane that the organ lies on; `normal` points from the board towards the organ.

    A `conforming` board is bedding or neighbouring tissue that has taken the shape of the organ's
    underside in the scan: it carries every downward-facing part of the surface where the scan shows it,
    and yields to sharp edges by a fraction of a millimetre.
    """

    name: str
    point_mm: FloatArray
    normal: FloatArray
    conforming: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "point_mm", frozen_floats(self.point_mm, (3,), "board point"))
        object.__setattr__(self, "normal", unit_vector(self.normal, "board normal"))


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
        if min(sizes) <= 0.0 or not 0.0 < self.edge_radius_mm <= min(sizes) / 2.0:
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


@dataclass(frozen=True)
class ContactLaw:
    """Friction while touching: |τ| ≤ friction · p + cohesion (shear only, no tension)."""

    friction: float = 0.1
    cohesion_kpa: float = 0.0

    def __post_init__(self) -> None:
        if not (0.0 <= self.friction < 10.0 and 0.0 <= self.cohesion_kpa < 1e6):
            raise BadInput(
                f"Friction must lie in 0 to 10 and cohesion in 0 to 10⁶ kPa, "
                f"not {self.friction} and {self.cohesion_kpa}."
            )


@dataclass(frozen=True)
class LeverDrive:
    """Where a stage takes a lever: to an angle, or by a force on its end (exactly one of the two).

    The force acts on the tip perpendicular to the arm; the lever then turns until the moment of the
    organ about the hinge balances it.
    """

    lever: str
    angle_deg: float | None = None
    force_n: float | None = None

    def __post_init__(self) -> None:
        if (self.angle_deg is None) == (self.force_n is None):
            raise BadInput(f"Drive lever {self.lever!r} either by angle_deg or by force_n.")
        if self.angle_deg is not None and not -90.0 <= self.angle_deg <= 90.0:
            raise BadInput(f"A lever turns by at most 90°, not {self.angle_deg}°.")
        if self.force_n is not None and not self.force_n >= 0.0:
            raise BadInput(f"The lifting force must not be negative ({self.force_n} N).")


@dataclass(frozen=True)
class Move:
    """A node set that a stage holds and carries by `displacement_mm` (LPS), as a grasper does that has hold of it."""

    node_set: str
    displacement_mm: tuple[float, float, float]

    def __post_init__(self) -> None:
        if len(self.displacement_mm) != 3 or not np.isfinite(self.displacement_mm).all():
            raise BadInput(f"Node set {self.node_set!r} moves by three numbers in mm, not by {self.displacement_mm}.")


@dataclass(frozen=True)
class Stage:
    """One stage: its own gravity, contact law, fixed node sets, tool motion, carried node sets and gas pressure.

    `drives` names the levers that move; the others hold the angle that they had. What `moves` carries is let go
    at the stage's end, unless the next stage names it among `fixed` or `moves`. The gas of a pneumoperitoneum presses
    on the whole surface (12 mmHg are 1.6 kPa).
    """

    name: str
    contact: ContactLaw
    drives: tuple[LeverDrive, ...] = ()
    gravity: bool = True
    fixed: tuple[str, ...] = ("back",)
    moves: tuple[Move, ...] = ()
    gas_pressure_kpa: float = 0.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.gas_pressure_kpa <= 20.0:
            raise BadInput(
                f"Stage {self.name!r}: the gas pressure must lie in 0 to 20 kPa, not {self.gas_pressure_kpa} kPa "
                "(12 mmHg are 1.6 kPa)."
            )


@dataclass(frozen=True, eq=False)
class Scenario:
    """The scan's loads and the stages of the manoeuvre.

    `scan_gravity` and `surgery_gravity` are unit LPS directions (None: weightless) that may differ;
    the boards named in `scan_supports` carried the organ during the scan.
    `rest_shape` "from-gravity" finds the unloaded shape; "as-scanned" takes A as free of stress.
    """

    tools: tuple[Board | Lever, ...]
    stages: tuple[Stage, ...]
    scan_gravity: FloatArray | None = None
    surgery_gravity: FloatArray | None = None
    scan_supports: tuple[str, ...] = ()
    rest_shape: Literal["from-gravity", "as-scanned"] = "from-gravity"

    def __post_init__(self) -> None:
        for field in ("scan_gravity", "surgery_gravity"):
            direction = getattr(self, field)
            if direction is not None:
                object.__setattr__(self, field, unit_vector(direction, field.replace("_", " ")))
        names = [tool.name for tool in self.tools]
        if len(set(names)) != len(names):
            raise BadInput(f"Tools need different names, not {names}.")
        if not self.stages:
            raise BadInput("A scenario needs at least one stage.")
        stages = [stage.name for stage in self.stages]
        if len(set(stages)) != len(stages):
            raise BadInput(f"Stages need different names, not {stages}.")
        levers = {tool.name for tool in self.tools if isinstance(tool, Lever)}
        boards = {tool.name for tool in self.tools if isinstance(tool, Board)}
        for stage in self.stages:
            for drive in stage.drives:
                if drive.lever not in levers:
                    raise BadInput(
                        f"Stage {stage.name!r} drives {drive.lever!r}, which is not a lever of the scenario."
                    )
        unknown = set(self.scan_supports) - boards
        if unknown:
            raise BadInput(f"Scan supports {sorted(unknown)} are not boards of the scenario.")
        if self.rest_shape not in ("from-gravity", "as-scanned"):
            raise BadInput(f"rest_shape must be from-gravity or as-scanned, not {self.rest_shape!r}.")
