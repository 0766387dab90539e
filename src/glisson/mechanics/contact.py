"""Contact of the organ's surface with one rigid tool, integrated at surface quadrature points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.scenario import ContactLaw
from glisson.mechanics.contact_law import (
    Cushion,
    shear_limit,
    shear_share,
    shear_slope,
    slip_energy,
)
from glisson.mechanics.elements import SurfaceQuadrature
from glisson.mechanics.tools import RigidTool

_GLUE_SHARE = 0.05  # of the cushion's stiffness


@dataclass(frozen=True, eq=False)
class Touch:
    """Where a tool's cushion is entered: surface points, gaps (mm), pressures (kPa) and frames."""

    points: IntArray
    local: FloatArray
    gaps: FloatArray
    pressures: FloatArray
    normals: FloatArray
    curvatures: FloatArray
    rotation: FloatArray


class ToolContact:
    """One tool, with what must be remembered from step to step: anchors and surface offsets.

    `offsets` (p,) correct the scanned surface, known to about a voxel only, onto the tool; see
    `rest_shape`. Friction uses the pressures and normals of the last call of `update_friction`.
    """

    def __init__(self, tool: RigidTool, surface: SurfaceQuadrature, cushion: Cushion, stick_mm: float) -> None:
        count = len(surface.areas)
        self.tool = tool
        self.cushion = cushion
        self.angle = 0.0
        self.offsets = np.zeros(count)
        self.anchors = np.zeros((count, 3))
        self.anchored = np.zeros(count, dtype=bool)
        self._surface = surface
        self._stick_mm = stick_mm
        self._cohering = np.zeros(count, dtype=bool)
        self._limits = np.zeros(count)
        self._lagged_normals = np.zeros((count, 3))

    def gaps(self, points_mm: FloatArray) -> FloatArray:
        """Gap (p,) of all surface points (p, 3), offsets included."""
        rotation, translation = self.tool.pose(self.angle)
        distances, _, _ = self.tool.distance((points_mm - translation) @ rotation)
        gaps: FloatArray = distances + self.offsets
        return gaps

    def touch(self, points_mm: FloatArray) -> Touch:
        """The surface points within the cushion."""
        rotation, translation = self.tool.pose(self.angle)
        local = (points_mm - translation) @ rotation
        distances, normals, curvatures = self.tool.distance(local)
        gaps = distances + self.offsets
        near = np.flatnonzero(gaps < self.cushion.range_mm)
        pressures = self.cushion.pressure(gaps[near])
        return Touch(near, local[near], gaps[near], pressures, normals[near], curvatures[near], rotation)

    def renew_cohesion(self, touch: Touch) -> int:
        """Let exactly the touching points cohere; how many of those that did had left the tool."""
        touching = np.zeros_like(self._cohering)
        touching[touch.points] = True
        left = int((self._cohering & ~touching).sum())
        self._cohering = touching
        return left

    def add_cohesion(self, touch: Touch) -> None:
        """Let points that newly touch cohere at once."""
        self._cohering[touch.points] = True

    def update_friction(self, touch: Touch, law: ContactLaw) -> None:
        """Take shear limits and normals from the present state; anchor the points that newly touch.

        A point that left the tool loses its anchor, unless cohesion still acts on it in this pass.
        """
        touching = self._cohering.copy()
        touching[touch.points] = True
        pressures = np.zeros(len(touching))
        pressures[touch.points] = touch.pressures
        local = np.zeros_like(self.anchors)
        local[touch.points] = touch.local
        new = touching & ~self.anchored
        self.anchors[new] = local[new]
        self.anchored = touching
        self._limits = shear_limit(pressures, self._cohering, law)
        self._lagged_normals[touch.points] = touch.normals

    def drag_anchors(self, points_mm: FloatArray) -> None:
        """Return mapping after a converged step: anchors follow what slipped further than sticking allows."""
        slipping, slips, lengths = self._slips(points_mm)
        excess = np.maximum(1.0 - self._stick_mm / np.maximum(lengths, 1e-300), 0.0)
        self.anchors[slipping] += excess[:, None] * slips

    def energy(self, points_mm: FloatArray) -> float:
        """Cushion and friction energy in µJ."""
        areas = self._surface.areas
        gaps = self.gaps(points_mm)
        near = np.flatnonzero(gaps < self.cushion.range_mm)
        normal = float(areas[near] @ self.cushion.energy(gaps[near]))
        slipping, _, lengths = self._slips(points_mm)
        return normal + float((areas * self._limits)[slipping] @ slip_energy(lengths, self._stick_mm))

    def forces(self, touch: Touch, points_mm: FloatArray) -> FloatArray:
        """Force of the tool on the organ at every surface point (p, 3), mN."""
        forces = np.zeros_like(points_mm)
        forces[touch.points] = touch.pressures[:, None] * touch.normals
        slipping, along = self._mobilised(points_mm)
        forces[slipping] -= self._limits[slipping, None] * along
        world: FloatArray = (forces * self._surface.areas[:, None]) @ touch.rotation.T
        return world

    def stiffness(self, touch: Touch, points_mm: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """Points (k,) and their 3 × 3 stiffness (k, 3, 3) in mN/mm.

        With `project` the tool's curvature is left out, which alone can make the block indefinite.
        """
        blocks = np.zeros((len(points_mm), 3, 3))
        outer = touch.normals[:, :, None] * touch.normals[:, None, :]
        blocks[touch.points] = self.cushion.slope(touch.gaps)[:, None, None] * outer
        if not project:
            blocks[touch.points] -= touch.pressures[:, None, None] * touch.curvatures
        slipping, slips, lengths = self._slips(points_mm)
        blocks[slipping] += self._friction_blocks(slipping, slips, lengths)
        used = np.union1d(touch.points, slipping)
        local = blocks[used] * self._surface.areas[used, None, None]
        return used, touch.rotation @ local @ touch.rotation.T

    def friction_by_pressure(self, touch: Touch, points_mm: FloatArray, law: ContactLaw) -> tuple[IntArray, FloatArray]:
        """What `stiffness` leaves out: friction that follows the pressure, at points (k,) as (k, 3, 3) in mN/mm.

        With it the linearisation is exact and not symmetric.
        """
        along = np.zeros_like(points_mm)
        slipping, mobilised = self._mobilised(points_mm)
        along[slipping] = mobilised
        used = touch.points
        slope = -law.friction * self.cushion.slope(touch.gaps) * self._surface.areas[used]
        local = slope[:, None, None] * along[used][:, :, None] * touch.normals[:, None, :]
        return used, touch.rotation @ local @ touch.rotation.T

    def bond(self, points_mm: FloatArray) -> tuple[IntArray, FloatArray]:
        """Points (k,) nearly in touch, and blocks (k, 3, 3) in mN/mm that hold them on the tool.

        They guide a body that nothing holds yet: where friction has begun, by its secant, which unlike its
        tangent does not vanish when it slips; elsewhere by a soft glue.
        """
        rotation, translation = self.tool.pose(self.angle)
        distances, normals, _ = self.tool.distance((points_mm - translation) @ rotation)
        near = np.flatnonzero(distances + self.offsets < 2.0 * self.cushion.range_mm)
        glue = _GLUE_SHARE * self.cushion.stiffness_kpa_mm
        along = np.full(len(self._limits), glue)
        slipping, _, lengths = self._slips(points_mm)
        along[slipping] = self._limits[slipping] / np.maximum(lengths, self._stick_mm)
        normals = normals[near] @ rotation.T
        outer = normals[:, :, None] * normals[:, None, :]
        held = glue * outer + along[near, None, None] * (np.eye(3) - outer)
        return near, self._surface.areas[near, None, None] * held

    def sticking(self, touch: Touch, points_mm: FloatArray) -> tuple[float, float]:
        """Share of the touching area that sticks, and the largest slip from an anchor (mm)."""
        if not len(touch.points):
            return 0.0, 0.0
        slipping, _, lengths = self._slips(points_mm)
        area = self._surface.areas[slipping]
        if not len(slipping) or area.sum() == 0.0:
            return 0.0, 0.0
        return float(area[lengths < self._stick_mm].sum() / area.sum()), float(lengths.max())

    def motion(self, points: IntArray, points_mm: FloatArray, angle: float) -> FloatArray:
        """How far the tool's material under the given points moves (k, 3) when it turns to `angle`."""
        rotation, translation = self.tool.pose(self.angle)
        local = (points_mm[points] - translation) @ rotation
        turned, shifted = self.tool.pose(angle)
        return local @ turned.T + shifted - points_mm[points]

    def memory(self) -> tuple[float, FloatArray, NDArray[np.bool_]]:
        """What a rejected step must put back."""
        return self.angle, self.anchors.copy(), self.anchored.copy()

    def recall(self, memory: tuple[float, FloatArray, NDArray[np.bool_]]) -> None:
        """Put back what `memory` returned."""
        self.angle, anchors, anchored = memory
        self.anchors, self.anchored = anchors.copy(), anchored.copy()

    def _slips(self, points_mm: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Points with friction, their tangential slip from the anchor in the tool frame, and its length."""
        points = np.flatnonzero(self._limits > 0.0)
        rotation, translation = self.tool.pose(self.angle)
        away = (points_mm[points] - translation) @ rotation - self.anchors[points]
        normals = self._lagged_normals[points]
        slips = away - np.einsum("pi,pi->p", away, normals)[:, None] * normals
        return points, slips, np.linalg.norm(slips, axis=1)

    def _mobilised(self, points_mm: FloatArray) -> tuple[IntArray, FloatArray]:
        """Points with friction, and the slip's direction times the share of the limit that is mobilised."""
        slipping, slips, lengths = self._slips(points_mm)
        return slipping, (shear_share(lengths, self._stick_mm) / np.maximum(lengths, 1e-300))[:, None] * slips

    def _friction_blocks(self, points: IntArray, slips: FloatArray, lengths: FloatArray) -> FloatArray:
        normals = self._lagged_normals[points]
        tangent_plane = np.eye(3) - normals[:, :, None] * normals[:, None, :]
        direction = slips / np.maximum(lengths, 1e-300)[:, None]
        along = direction[:, :, None] * direction[:, None, :]
        # share / length tends to 2 / stick as the slip vanishes.
        across = np.where(lengths > 1e-9, shear_share(lengths, self._stick_mm) / np.maximum(lengths, 1e-9), 0.0)
        across = np.where(lengths > 1e-9, across, 2.0 / self._stick_mm)
        slope = shear_slope(lengths, self._stick_mm)
        blocks = across[:, None, None] * (tangent_plane - along) + slope[:, None, None] * along
        result: FloatArray = self._limits[points][:, None, None] * blocks
        return result
