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

    def stiffness(
        self, gaps: FloatArray, areas: FloatArray, normals: FloatArray, curvatures: FloatArray | None
    ) -> FloatArray:
        """Stiffness (p, 3, 3) in mN/mm at points; without the tool's curvatures it is never negative."""
        blocks = (areas * self.cushion.slope(gaps))[:, None, None] * normals[:, :, None] * normals[:, None, :]
        if curvatures is None:
            return blocks
        result: FloatArray = blocks - (areas * self.cushion.pressure(gaps))[:, None, None] * curvatures
        return result

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Outward normals (p, 3) and curvatures (p, 3, 3), 1/mm, of the distance at points (p, 3)."""
        normals, curvatures = self.tool.derivatives((points - self.translation) @ self.rotation)
        return normals @ self.rotation.T, self.rotation @ curvatures @ self.rotation.T
