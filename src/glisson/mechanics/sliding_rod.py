"""A wire or stent in a duct: an elastic rod that bends with the duct and slides along it with friction.

The rod's points lie on the duct's centreline at arc lengths s of A. For every shape of the organ the s are those of
least energy, so that the organ feels the rod through them, and its own unknowns are the nodes alone.
"""

from dataclasses import dataclass, replace

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.deformation import RodReport
from glisson.core.mesh import TetMesh
from glisson.core.model import Rod
from glisson.core.structures import Curve
from glisson.core.units import millinewtons_from_newtons, newtons_from_millinewtons
from glisson.mechanics.contact_law import shear_share, shear_slope, slip_energy
from glisson.mechanics.duct_path import DuctPath

_SPACING_MM = 2.0
_STICK_MM = 0.02
_STEPS, _HALVINGS = 100, 40
_ACCURACY = 1e-11  # of the largest force along the rod
_ROUNDING = 1e-14  # of the forces of which that is the difference
_LIMIT_PASSES = 200
_LIMIT_ACCURACY = 1e-9


@dataclass(frozen=True, eq=False)
class _State:
    """Arc lengths (m,), where each point sticks (m,), and friction limits (m,) in mN per mm of arc length of A."""

    arcs: FloatArray
    anchors: FloatArray
    limits: FloatArray


class SlidingRod:
    """A `Part`, straight where nothing bends it; its first point is held at the duct's mouth, or drawn out of it.

    `drawn_mm` says how far. Its length between the points is that of A.

    Args:
        mesh: the organ in A.
        duct: centreline, from the mouth inward.
        length_mm: of the rod, measured from the mouth.
        rod: its stiffness and friction.
    """

    def __init__(self, mesh: TetMesh, duct: Curve, length_mm: float, rod: Rod) -> None:
        self.drawn_mm = 0.0
        self._path = DuctPath(mesh, duct, length_mm)
        count = max(round(length_mm / _SPACING_MM), 4) + 1
        arcs = np.linspace(0.0, length_mm, count)
        steps = np.diff(self._path.places(mesh.nodes, arcs), axis=0)
        self._lengths = np.linalg.norm(steps, axis=1)  # at rest: those of A, so that it is not strained there
        mean = float(self._lengths.mean())
        self._axial = millinewtons_from_newtons(rod.axial_stiffness_n) / self._lengths
        root = np.sqrt(millinewtons_from_newtons(rod.bending_stiffness_n_mm2) / mean**3)
        self._bends = root * np.diff(np.eye(count), n=2, axis=0)  # bending energy is ½ |B p|²
        self._friction = rod.friction
        ends = np.where((arcs == arcs[0]) | (arcs == arcs[-1]), 0.5, 1.0)
        self._grip = millinewtons_from_newtons(rod.grip_n_mm) * mean * ends
        self._state = _State(arcs, arcs.copy(), self._grip)
        self._start = arcs
        self._rounding = _ROUNDING * float((self._axial * self._lengths).max() + 6.0 * root**2 * length_mm)

    def energy(self, positions: FloatArray) -> float:
        """Bending, stretch and friction in µJ, at friction limits as last renewed."""
        return self._energy(positions, self._settled(positions))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (n, 3) in mN."""
        forces = np.zeros_like(positions)
        arcs = self._settled(positions)
        pulls, _ = self._elastic(positions, arcs, project=False)
        forces[self._path.nodes] = -self._path.weights(arcs, 0).T @ pulls
        return forces

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """One group, of all nodes that carry the duct: the rod's stiffness after it has slid where it will."""
        arcs = self._settled(positions)
        pulls, stiff = self._elastic(positions, arcs, project)
        tangents = self._path.places(positions, arcs, 1)
        weights, slopes = self._path.weights(arcs, 0), self._path.weights(arcs, 1)
        count, nodes = len(arcs), len(self._path.nodes)
        along = np.einsum("ipjq,jq->ipj", stiff, tangents)
        sliding = self._sliding(positions, arcs, pulls, stiff, project)
        mixed = np.einsum("ia,ipj->apj", weights, along)
        if not project:
            mixed += np.einsum("ip,ia->api", pulls, slopes)
        half = np.tensordot(weights, stiff, (0, 0)).reshape(nodes * 3, count, 3)
        whole = np.einsum("xjq,jb->xqb", half, weights, optimize=True).reshape(nodes, 3, 3, nodes)
        local = whole.transpose(0, 3, 1, 2).copy()
        mixed = mixed[:, :, 1:].reshape(nodes * 3, count - 1)  # the first point is held
        given = mixed @ np.linalg.solve(sliding, mixed.T)
        local -= given.reshape(nodes, 3, nodes, 3).transpose(0, 2, 1, 3)
        return self._path.nodes[None], local[None]

    def renew(self, positions: FloatArray) -> None:
        """Let friction's limits follow how hard the rod lies against the duct."""
        for _ in range(_LIMIT_PASSES):
            arcs = self._settled(positions)
            pulls, _ = self._elastic(positions, arcs, project=False)
            tangents = self._path.places(positions, arcs, 1)
            stretch = np.linalg.norm(tangents, axis=1)
            along = np.einsum("ip,ip->i", pulls, tangents) / stretch
            across = pulls - (along / stretch)[:, None] * tangents
            limits = (self._friction * np.linalg.norm(across, axis=1) + self._grip) * stretch
            change = float(np.abs(limits - self._state.limits).max())
            self._state = replace(self._state, limits=limits)
            if change <= _LIMIT_ACCURACY * float(limits.max()):
                break

    def accept(self, positions: FloatArray) -> None:
        """Anchors follow what slid further than sticking allows."""
        arcs = self._settled(positions)
        slips = arcs - self._state.anchors
        excess = np.maximum(1.0 - _STICK_MM / np.maximum(np.abs(slips), 1e-300), 0.0)
        self._state = replace(self._state, anchors=self._state.anchors + excess * slips)

    def memory(self) -> _State:
        """Where it lies and sticks."""
        return self._state

    def recall(self, memory: _State) -> None:
        """Put that back."""
        self._state = memory

    def report(self, positions: FloatArray) -> RodReport:
        """How far it slid and how it is pulled."""
        arcs = self._settled(positions)
        slides = arcs - self._start
        lengths = np.linalg.norm(np.diff(self._path.places(positions, arcs), axis=0), axis=1)
        tension = float(self._axial[0] * (lengths[0] - self._lengths[0]) - self._rub(arcs)[0])
        return RodReport(float(slides[-1]), float(np.abs(slides).max()), newtons_from_millinewtons(tension))

    def _settled(self, positions: FloatArray) -> FloatArray:
        """Arc lengths (m,) of least energy, by Newton's method from where the rod last was."""
        arcs = self._state.arcs.copy()
        arcs[0] = -self.drawn_mm
        for _ in range(_STEPS):
            pulls, stiff = self._elastic(positions, arcs, project=False)
            tangents = self._path.places(positions, arcs, 1)
            rub = self._rub(arcs)
            slope = (np.einsum("ip,ip->i", pulls, tangents) + rub)[1:]
            scale = float(np.abs(pulls).max() + np.abs(rub).max())
            if float(np.abs(slope).max()) <= max(_ACCURACY * scale, self._rounding):
                break
            step = self._step(positions, arcs, pulls, stiff, slope)
            start, length = self._energy(positions, arcs), 1.0
            for _ in range(_HALVINGS):
                moved = arcs.copy()
                moved[1:] += length * step
                if self._energy(positions, moved) <= start + 1e-4 * length * float(slope @ step) + 1e-13 * abs(start):
                    break
                length *= 0.5
            arcs = moved
        self._state = replace(self._state, arcs=arcs)
        return arcs

    def _rub(self, arcs: FloatArray) -> FloatArray:
        """Friction (m,) in mN that the duct's slipping tissue feels along s."""
        slips = arcs - self._state.anchors
        rub: FloatArray = self._state.limits * shear_share(np.abs(slips), _STICK_MM) * np.sign(slips)
        return rub

    def _step(
        self, positions: FloatArray, arcs: FloatArray, pulls: FloatArray, stiff: FloatArray, slope: FloatArray
    ) -> FloatArray:
        """Newton's step; with what is definite of the stiffness where the whole of it leads uphill."""
        step = np.linalg.solve(self._sliding(positions, arcs, pulls, stiff, project=False), -slope)
        if float(step @ slope) >= 0.0:
            definite = self._elastic(positions, arcs, project=True)[1]
            step = np.linalg.solve(self._sliding(positions, arcs, pulls, definite, project=True), -slope)
        return np.asarray(step)

    def _sliding(
        self, positions: FloatArray, arcs: FloatArray, pulls: FloatArray, stiff: FloatArray, project: bool
    ) -> FloatArray:
        """∂²E/∂s² (m − 1, m − 1) of all points but the held one."""
        tangents = self._path.places(positions, arcs, 1)
        sliding = np.einsum("ip,ipjq,jq->ij", tangents, stiff, tangents, optimize=True)
        slips = np.abs(arcs - self._state.anchors)
        own = self._state.limits * shear_slope(slips, _STICK_MM)
        if not project:
            own = own + np.einsum("ip,ip->i", pulls, self._path.places(positions, arcs, 2))
        sliding[np.diag_indices(len(arcs))] += own
        result: FloatArray = sliding[1:, 1:]
        return result

    def _energy(self, positions: FloatArray, arcs: FloatArray) -> float:
        places = self._path.places(positions, arcs)
        lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
        stretched = 0.5 * float(self._axial @ (lengths - self._lengths) ** 2)
        bent = 0.5 * float(np.sum((self._bends @ places) ** 2))
        slips = np.abs(arcs - self._state.anchors)
        return stretched + bent + float(self._state.limits @ slip_energy(slips, _STICK_MM))

    def _elastic(self, positions: FloatArray, arcs: FloatArray, project: bool) -> tuple[FloatArray, FloatArray]:
        """∂E/∂p (m, 3) and ∂²E/∂p² (m, 3, m, 3) of bending and stretch by the points' places."""
        places = self._path.places(positions, arcs)
        steps = np.diff(places, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        units = steps / lengths[:, None]
        tensions = self._axial * (lengths - self._lengths)
        pulls = self._bends.T @ (self._bends @ places)
        pulls[1:] += tensions[:, None] * units
        pulls[:-1] -= tensions[:, None] * units
        count = len(arcs)
        stiff = np.einsum("ij,pq->ipjq", self._bends.T @ self._bends, np.eye(3))
        outer = units[:, :, None] * units[:, None, :]
        sideways = tensions / lengths
        if project:
            sideways = np.maximum(sideways, 0.0)
        blocks = self._axial[:, None, None] * outer + sideways[:, None, None] * (np.eye(3) - outer)
        near, far = np.arange(count - 1), np.arange(1, count)
        for a, b, sign in ((near, near, 1.0), (far, far, 1.0), (near, far, -1.0), (far, near, -1.0)):
            stiff[a, :, b, :] += sign * blocks
        return pulls, stiff
