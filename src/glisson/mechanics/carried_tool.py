"""Tools that stages carry from place to place."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.scenario import ToolMotion
from glisson.core.transform import RigidTransform

_ARM_MM = 40.0  # a way that counts as a turn by one radian


class CarriedTool:
    """The motion of a tool whose frame is the patient's as long as it has not moved.

    The "angle" of its poses is the way that it has gone since the start, in radians of its turn or in `_ARM_MM`.
    """

    yields = False

    def __init__(self, name: str, edge_radius_mm: float, moves: bool) -> None:
        self.name = name
        self.moves = moves
        self.edge_radius_mm: float | None = edge_radius_mm
        self._rotation, self._translation = np.eye(3), np.zeros(3)
        self._set_out_at, self._way = 0.0, 1.0
        self._motion: ToolMotion | None = None

    def set_out(self, angle: float, motion: ToolMotion) -> float:
        """Begin a motion at the pose of `angle`; the angle at its end."""
        self._rotation, self._translation = self.pose(angle)
        turn = float(np.linalg.norm(np.radians(motion.turn_deg)))
        way = max(turn, float(np.linalg.norm(motion.displacement_mm)) / _ARM_MM)
        self._motion, self._set_out_at, self._way = (motion, angle, way) if way > 0.0 else (None, angle, 1.0)
        return angle + way

    def pose(self, angle: float) -> tuple[FloatArray, FloatArray]:
        """Rotation and translation after that way."""
        if self._motion is None:
            return self._rotation, self._translation
        moved: RigidTransform = self._motion.pose((angle - self._set_out_at) / self._way)
        return moved.rotation @ self._rotation, moved.apply(self._translation)
