"""What is done to the organ, stage by stage: gravity, supports, tools, contact (LPS mm)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from glisson.core.arrays import FloatArray, unit_vector
from glisson.core.errors import BadInput
from glisson.core.tools import Board, Cylinder, Lever, MeshTool, Tool
from glisson.core.transform import RigidTransform


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
        if self.force_n is not None and not 0.0 <= self.force_n < np.inf:
            raise BadInput(f"The lifting force must be a number that is not negative, not {self.force_n} N.")


@dataclass(frozen=True)
class Move:
    """A node set that a stage holds and carries by `displacement_mm` (LPS), as a grasper does that has hold of it."""

    node_set: str
    displacement_mm: tuple[float, float, float]

    def __post_init__(self) -> None:
        if len(self.displacement_mm) != 3 or not np.isfinite(self.displacement_mm).all():
            raise BadInput(f"Node set {self.node_set!r} moves by three numbers in mm, not by {self.displacement_mm}.")


@dataclass(frozen=True)
class ToolMotion:
    """How a stage carries a cylinder or a mesh tool: by `displacement_mm` (LPS), turning evenly as it goes.

    `turn_deg` is a rotation vector in degrees, about the point `about_mm` that goes along; it needs that point.
    """

    tool: str
    displacement_mm: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)
    about_mm: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        vectors = (self.displacement_mm, self.turn_deg, self.about_mm or (0.0, 0.0, 0.0))
        if not all(len(vector) == 3 and np.isfinite(vector).all() for vector in vectors):
            raise BadInput(f"A motion of tool {self.tool!r} needs three finite numbers for each vector.")
        if any(self.turn_deg) and self.about_mm is None:
            raise BadInput(f"A turn of tool {self.tool!r} needs about_mm, the point about which it turns.")

    def pose(self, share: float) -> RigidTransform:
        """Where a share of the motion takes points of the patient's frame."""
        from scipy.spatial.transform import Rotation  # slow to load, and `--help` needs this module

        about = np.zeros(3) if self.about_mm is None else np.array(self.about_mm)
        turn = Rotation.from_rotvec(share * np.radians(self.turn_deg)).as_matrix()
        return RigidTransform("patient", "patient", turn, about - turn @ about + share * np.array(self.displacement_mm))


@dataclass(frozen=True)
class Stage:
    """One stage: its own gravity, contact law, fixed node sets, tool motion, carried node sets and gas pressure.

    `drives` names the levers that move, `motions` the cylinders and mesh tools; others stay where they are. What
    `moves` carries is let go at the stage's end, unless the next stage names it among `fixed` or `moves`. The gas of a
    pneumoperitoneum presses on the whole surface (12 mmHg are 1.6 kPa).
    """

    name: str
    contact: ContactLaw
    drives: tuple[LeverDrive, ...] = ()
    gravity: bool = True
    fixed: tuple[str, ...] = ("back",)
    moves: tuple[Move, ...] = ()
    gas_pressure_kpa: float = 0.0
    motions: tuple[ToolMotion, ...] = ()

    def __post_init__(self) -> None:
        if isinstance(self.fixed, str):
            raise BadInput(f"Stage {self.name!r}: fixed is a list of node sets, not the text {self.fixed!r}.")
        both = sorted({move.node_set for move in self.moves} & set(self.fixed))
        if both:
            raise BadInput(f"Stage {self.name!r} both fixes and moves node set {both[0]!r}; it can do one of them.")
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

    tools: tuple[Tool, ...]
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
        for stage in self.stages:
            for kind, named in (
                ("drives lever", [drive.lever for drive in stage.drives]),
                ("moves tool", [motion.tool for motion in stage.motions]),
                ("moves node set", [move.node_set for move in stage.moves]),
            ):
                twice = sorted({name for name in named if named.count(name) > 1})
                if twice:
                    raise BadInput(f"Stage {stage.name!r} {kind} {twice[0]!r} twice; give it one goal.")
        levers = {tool.name for tool in self.tools if isinstance(tool, Lever)}
        boards = {tool.name for tool in self.tools if isinstance(tool, Board)}
        for stage in self.stages:
            for drive in stage.drives:
                if drive.lever not in levers:
                    raise BadInput(
                        f"Stage {stage.name!r} drives {drive.lever!r}, which is not a lever of the scenario."
                    )
        carried = {tool.name for tool in self.tools if isinstance(tool, Cylinder | MeshTool)}
        for stage in self.stages:
            for motion in stage.motions:
                if motion.tool not in carried:
                    raise BadInput(f"Stage {stage.name!r} moves {motion.tool!r}, which is no cylinder or mesh tool.")
        unknown = set(self.scan_supports) - boards
        if unknown:
            raise BadInput(f"Scan supports {sorted(unknown)} are not boards of the scenario.")
        if self.rest_shape not in ("from-gravity", "as-scanned"):
            raise BadInput(f"rest_shape must be from-gravity or as-scanned, not {self.rest_shape!r}.")

    def tool_pose(self, tool: str, stage: str) -> RigidTransform:
        """Where a carried tool's points of the scan are at a stage's end."""
        rotation, translation = np.eye(3), np.zeros(3)
        for known in self.stages:
            for motion in known.motions:
                if motion.tool == tool:
                    pose = motion.pose(1.0)
                    rotation, translation = pose.rotation @ rotation, pose.apply(translation)
            if known.name == stage:
                break
        return RigidTransform("patient", "patient", rotation, translation)
