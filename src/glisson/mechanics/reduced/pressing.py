"""A rigid tool that presses on surface points without friction."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.contact_law import Cushion
from glisson.mechanics.reduced.load import Load
from glisson.mechanics.tools import RigidTool


@dataclass(frozen=True, eq=False)
class Pressing:
    """The tool where it stands: `rotation` (3, 3) and `translation` (3,) in mm take its points to the patient's."""

    tool: RigidTool
    cushion: Cushion
    rotation: FloatArray
    translation: FloatArray

    @classmethod
    def of(cls, load: Load, cushion: Cushion) -> "Pressing | None":
        """The tool of a load; None where there is none."""
        if load.tool is None:
            return None
        rotation, translation = load.tool.pose(0.0)
        return cls(load.tool, cushion, rotation, translation - load.withdrawn * load.approach)

    def gaps(self, points: FloatArray) -> FloatArray:
        """Gaps (p,) in mm of points (p, 3)."""
        return self.tool.distance((points - self.translation) @ self.rotation)

    def energy(self, gaps: FloatArray, areas: FloatArray) -> float:
        """The cushion's energy in µJ."""
        return float(areas @ self.cushion.energy(gaps))

    def near(self, gaps: FloatArray) -> IntArray:
        """Numbers of the points that it presses on."""
        return np.flatnonzero(gaps < self.cushion.range_mm)

    def normals(self, points: FloatArray) -> FloatArray:
        """Its outward normals (p, 3) at points (p, 3)."""
        return self._derivatives(points)[0]

    def pushes(self, points: FloatArray, gaps: FloatArray, areas: FloatArray) -> FloatArray:
        """Forces (p, 3) in mN on points (p, 3)."""
        normals, _ = self._derivatives(points)
        result: FloatArray = (areas * self.cushion.pressure(gaps))[:, None] * normals
        return result

    def stiffness(self, points: FloatArray, gaps: FloatArray, areas: FloatArray, project: bool) -> FloatArray:
        """Stiffness (p, 3, 3) in mN/mm at points; `project` leaves the tool's curvature out, which may be negative."""
        normals, curvatures = self._derivatives(points)
        blocks = (areas * self.cushion.slope(gaps))[:, None, None] * normals[:, :, None] * normals[:, None, :]
        if project:
            return blocks
        result: FloatArray = blocks - (areas * self.cushion.pressure(gaps))[:, None, None] * curvatures
        return result

    def _derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        normals, curvatures = self.tool.derivatives((points - self.translation) @ self.rotation)
        return normals @ self.rotation.T, self.rotation @ curvatures @ self.rotation.T
