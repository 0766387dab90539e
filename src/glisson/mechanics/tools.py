"""Rigid tools as signed distances: gap, normal and curvature at points given in the tool's frame."""

from collections.abc import Sequence
from typing import Protocol

from glisson.core.arrays import FloatArray
from glisson.core.scenario import Stage
from glisson.core.tools import Board, Cylinder, Lever, Tool
from glisson.mechanics.board_tool import BoardTool
from glisson.mechanics.cylinder import CylinderTool
from glisson.mechanics.lever_tool import LeverTool
from glisson.mechanics.mesh_tool import SurfaceTool


class RigidTool(Protocol):
    """A rigid body and its motion.

    The tool's frame is fixed to the tool; `pose(angle)` gives `patient_from_tool` (rotation and
    translation) at an angle in radians, or at what stands for one (see `CarriedTool`).
    """

    name: str
    yields: bool
    """Whether it stands for soft neighbours, into which the organ may press by a fraction of a millimetre."""
    moves: bool
    """Whether stages may move it; organs follow it through its edges, which takes a solver of its own."""
    edge_radius_mm: float | None
    """Of its sharpest edge; None where it has none."""

    def pose(self, angle: float) -> tuple[FloatArray, FloatArray]:
        """Rotation (3, 3) and translation (3,) in mm that take tool points to the patient frame."""

    def distance(self, points: FloatArray) -> FloatArray:
        """Signed distance (n,) mm of tool-frame points (n, 3)."""

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The distance's gradient (n, 3) and Hessian (n, 3, 3) at tool-frame points (n, 3)."""


def make_tool(tool: Tool, stages: Sequence[Stage] = ()) -> RigidTool:
    """The distance function of a scenario's tool; cylinders and mesh tools move where a stage carries them."""
    if isinstance(tool, Board):
        return BoardTool(tool)
    if isinstance(tool, Lever):
        return LeverTool(tool)
    moves = any(motion.tool == tool.name for stage in stages for motion in stage.motions)
    return CylinderTool(tool, moves) if isinstance(tool, Cylinder) else SurfaceTool(tool, moves)
