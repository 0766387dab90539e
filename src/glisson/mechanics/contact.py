"""Contact of the organ's surface with one rigid tool, integrated at surface quadrature points."""

from dataclasses import dataclass, fields

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


@dataclass(eq=False)
class PointStates:
    """What a tool remembers of every surface point from step to step.

    `offsets` (p,) correct the scanned surface, known to about a voxel only, onto the tool (see `settle_gaps`);
    `anchors` (p, 3), in the tool's frame, are where points stick; `anchored` and `cohering` (p,) say which do.
    Shear limits (p,) in kPa and normals (p, 3) are those of the last call of `update_friction`.
    """

    offsets: FloatArray
    anchors: FloatArray
    anchored: NDArray[np.bool_]
    cohering: NDArray[np.bool_]
    limits: FloatArray
    normals: FloatArray

    @classmethod
    def of(cls, count: int) -> "PointStates":
        """Points that never touched."""
        none = np.zeros(count, dtype=bool)
        return cls(np.zeros(count), np.zeros((count, 3)), none, none.copy(), np.zeros(count), np.zeros((count, 3)))

    def take(self, points: IntArray | slice = slice(None)) -> "PointStates":
        """A copy, of all points or of some."""
        return PointStates(*(np.array(getattr(self, field.name)[points]) for field in fields(self)))

    def put(self, points: IntArray, states: "PointStates") -> None:
        """Overwrite some points."""
        for field in fields(self):
            getattr(self, field.name)[points] = getattr(states, field.name)


class ToolContact:
    """One tool at one angle (rad), and what it remembers of the organ's surface points."""

    def __init__(self, tool: RigidTool, surface: SurfaceQuadrature, cushion: Cushion, stick_mm: float) -> None:
        count = len(surface.areas)
        self.tool = tool
        self.cushion = cushion
        self.angle = 0.0
        self.states = PointStates.of(count)
        self._surface = surface
        self._stick_mm = stick_mm

    def part(self, points: IntArray) -> "ToolContact":
        """The same tool over some of the surface points, with a copy of their states."""
        part = ToolContact(self.tool, self._surface.part(points), self.cushion, self._stick_mm)
        part.angle, part.states = self.angle, self.states.take(points)
        return part

    def gaps(self, points_mm: FloatArray) -> FloatArray:
        """Gap (p,) of all surface points (p, 3), offsets included."""
        rotation, translation = self.tool.pose(self.angle)
        gaps: FloatArray = self.tool.distance((points_mm - translation) @ rotation) + self.states.offsets
        return gaps

    def touch(self, points_mm: FloatArray) -> Touch:
        """The surface points within the cushion."""
        rotation, translation = self.tool.pose(self.angle)
        local = (points_mm - translation) @ rotation
        gaps = self.tool.distance(local) + self.states.offsets
        near = np.flatnonzero(gaps < self.cushion.range_mm)
        gaps, local = gaps[near], local[near]
        return Touch(near, local, gaps, self.cushion.pressure(gaps), *self.tool.derivatives(local), rotation)

    def renew_cohesion(self, touch: Touch) -> int:
        """Let exactly the touching points cohere; how many of those that did had left the tool."""
        touching = np.zeros_like(self.states.cohering)
        touching[touch.points] = True
        left = int((self.states.cohering & ~touching).sum())
        self.states.cohering = touching
        return left

    def add_cohesion(self, touch: Touch) -> None:
        """Let points that newly touch cohere at once."""
        self.states.cohering[touch.points] = True

    def update_friction(self, touch: Touch, law: ContactLaw) -> None:
        """Take shear limits and normals from the present state; anchor the points that newly touch.

        A point that left the tool loses its anchor, unless cohesion still acts on it in this pass.
        """
        touching = self.states.cohering.copy()
        touching[touch.points] = True
        pressures = np.zeros(len(touching))
        pressures[touch.points] = touch.pressures
        local = np.zeros_like(self.states.anchors)
        local[touch.points] = touch.local
        new = touching & ~self.states.anchored
        self.states.anchors[new] = local[new]
        self.states.anchored = touching
        self.states.limits = shear_limit(pressures, self.states.cohering, law)
        self.states.normals[touch.points] = touch.normals

    def drag_anchors(self, points_mm: FloatArray) -> None:
        """Return mapping after a converged step: anchors follow what slipped further than sticking allows."""
        slipping, slips, lengths = self._slips(points_mm)
        excess = np.maximum(1.0 - self._stick_mm / np.maximum(lengths, 1e-300), 0.0)
        self.states.anchors[slipping] += excess[:, None] * slips

    def energy(self, points_mm: FloatArray) -> float:
        """Cushion and friction energy in µJ."""
        areas = self._surface.areas
        gaps = self.gaps(points_mm)
        near = np.flatnonzero(gaps < self.cushion.range_mm)
        normal = float(areas[near] @ self.cushion.energy(gaps[near]))
        slipping, _, lengths = self._slips(points_mm)
        return normal + float((areas * self.states.limits)[slipping] @ slip_energy(lengths, self._stick_mm))

    def forces(self, touch: Touch, points_mm: FloatArray) -> FloatArray:
        """Force of the tool on the organ at every surface point (p, 3), mN."""
        forces = np.zeros_like(points_mm)
        forces[touch.points] = touch.pressures[:, None] * touch.normals
        slipping, along = self._mobilised(points_mm)
        forces[slipping] -= self.states.limits[slipping, None] * along
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
        """What `stiffness` leaves out: friction that follows the pressure and turns with a curved tool's normal.

        At points (k,) as (k, 3, 3) in mN/mm; with it the linearisation is exact and not symmetric.
        """
        along = np.zeros_like(points_mm)
        slipping, mobilised = self._mobilised(points_mm)
        along[slipping] = mobilised
        used = touch.points
        slope = -law.friction * self.cushion.slope(touch.gaps)
        local = slope[:, None, None] * along[used][:, :, None] * touch.normals[:, None, :]
        local = (local + self._friction_by_turn(touch)) * self._surface.areas[used, None, None]
        return used, touch.rotation @ local @ touch.rotation.T

    def bond(self, points_mm: FloatArray) -> tuple[IntArray, FloatArray]:
        """Points (k,) nearly in touch, and blocks (k, 3, 3) in mN/mm that hold them on the tool.

        They guide a body that nothing holds yet: where friction has begun, by its secant, which unlike its
        tangent does not vanish when it slips; elsewhere by a soft glue.
        """
        rotation, translation = self.tool.pose(self.angle)
        local = (points_mm - translation) @ rotation
        near = np.flatnonzero(self.tool.distance(local) + self.states.offsets < 2.0 * self.cushion.range_mm)
        glue = _GLUE_SHARE * self.cushion.stiffness_kpa_mm
        along = np.full(len(self.states.limits), glue)
        slipping, _, lengths = self._slips(points_mm)
        along[slipping] = self.states.limits[slipping] / np.maximum(lengths, self._stick_mm)
        normals = self.tool.derivatives(local[near])[0] @ rotation.T
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

    def motion(self, points_mm: FloatArray, angle: float) -> FloatArray:
        """How far the tool's material under the points (p, 3) moves (p, 3) when it turns to `angle`."""
        rotation, translation = self.tool.pose(self.angle)
        turned, shifted = self.tool.pose(angle)
        return (points_mm - translation) @ rotation @ turned.T + shifted - points_mm

    def memory(self) -> tuple[float, PointStates]:
        """What a rejected step must put back."""
        return self.angle, self.states.take()

    def recall(self, memory: tuple[float, PointStates]) -> None:
        """Put back what `memory` returned."""
        self.angle, states = memory
        self.states = states.take()

    def _slips(self, points_mm: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Points with friction, their tangential slip from the anchor in the tool frame, and its length."""
        points = np.flatnonzero(self.states.limits > 0.0)
        rotation, translation = self.tool.pose(self.angle)
        away = (points_mm[points] - translation) @ rotation - self.states.anchors[points]
        normals = self.states.normals[points]
        slips = away - np.einsum("pi,pi->p", away, normals)[:, None] * normals
        return points, slips, np.linalg.norm(slips, axis=1)

    def _mobilised(self, points_mm: FloatArray) -> tuple[IntArray, FloatArray]:
        """Points with friction, and the slip's direction times the share of the limit that is mobilised."""
        slipping, slips, lengths = self._slips(points_mm)
        return slipping, (shear_share(lengths, self._stick_mm) / np.maximum(lengths, 1e-300))[:, None] * slips

    def _friction_by_turn(self, touch: Touch) -> FloatArray:
        """−∂(shear stress)/∂x (k, 3, 3) by the turn δn = H δx of the normals at the touching points.

        The slip s = a − (a·n) n, with a from the anchor, changes by −(a·H δx) n − (a·n) H δx; along n the shear
        stress only turns, as its length has no slope there.
        """
        away = touch.local - self.states.anchors[touch.points]
        heights = np.einsum("pi,pi->p", away, touch.normals)
        slips = away - heights[:, None] * touch.normals
        lengths = np.linalg.norm(slips, axis=1)
        secants = self.states.limits[touch.points] * _secant_share(lengths, self._stick_mm)
        turned = np.einsum("pi,pij->pj", away, touch.curvatures)
        result: FloatArray = -secants[:, None, None] * touch.normals[:, :, None] * turned[:, None, :]
        result -= heights[:, None, None] * (self._friction_blocks(touch.points, slips, lengths) @ touch.curvatures)
        return result

    def _friction_blocks(self, points: IntArray, slips: FloatArray, lengths: FloatArray) -> FloatArray:
        normals = self.states.normals[points]
        tangent_plane = np.eye(3) - normals[:, :, None] * normals[:, None, :]
        direction = slips / np.maximum(lengths, 1e-300)[:, None]
        along = direction[:, :, None] * direction[:, None, :]
        across = _secant_share(lengths, self._stick_mm)
        slope = shear_slope(lengths, self._stick_mm)
        blocks = across[:, None, None] * (tangent_plane - along) + slope[:, None, None] * along
        result: FloatArray = self.states.limits[points][:, None, None] * blocks
        return result


def _secant_share(lengths: FloatArray, stick_mm: float) -> FloatArray:
    """Mobilised share over slip in 1/mm, which tends to 2 / stick as the slip vanishes."""
    share: FloatArray = shear_share(lengths, stick_mm) / np.maximum(lengths, 1e-9)
    return np.where(lengths > 1e-9, share, 2.0 / stick_mm)
