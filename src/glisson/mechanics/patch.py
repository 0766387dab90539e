"""The part of the surface that moving tools may touch in a load step."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.body import Body
from glisson.mechanics.elements import SurfaceQuadrature

_REACH_MM = 4.0  # beyond the way that the tool goes


@dataclass(frozen=True, eq=False)
class Patch:
    """Surface points (p,), their nodes (m,), and those nodes' free unknowns.

    `surface` numbers the nodes 0 … m − 1. `unknowns` (k,) are numbers into the nodes' 3 m unknowns, and `kept`
    (k,) the same unknowns' ascending numbers in the body's free system.
    """

    points: IntArray
    nodes: IntArray
    surface: SurfaceQuadrature
    unknowns: IntArray
    kept: IntArray

    def covers(self, points: IntArray) -> bool:
        """Whether all the given surface points are among the patch's."""
        return bool(np.isin(points, self.points, assume_unique=True).all())


def points_near_tools(body: Body, positions: FloatArray, goal: tuple[float, ...], reach_mm: float) -> IntArray:
    """Surface points that the moving tools come near to on their way to the angles `goal`."""
    points = body.surface.positions(positions)
    near = np.zeros(len(points), dtype=bool)
    for number in body.moving:
        contact = body.contacts[number]
        way = np.linalg.norm(contact.motion(points, goal[number]), axis=1)
        near |= contact.gaps(points) < reach_mm + way
    return np.flatnonzero(near)


def find_patch(body: Body, positions: FloatArray, goal: tuple[float, ...], known: Patch | None) -> Patch | None:
    """The known patch where it still covers what the tools may touch, else a new one; None without such points."""
    needed = points_near_tools(body, positions, goal, _REACH_MM)
    if not len(needed):
        return None
    if known is not None and known.covers(needed):
        return known
    # Somewhat more than needed, so that it serves for some steps.
    return make_patch(body, points_near_tools(body, positions, goal, 2.0 * _REACH_MM))


def make_patch(body: Body, points: IntArray) -> Patch:
    """The patch of the given surface points."""
    part = body.surface.part(points)
    nodes, local = np.unique(part.nodes, return_inverse=True)
    surface = SurfaceQuadrature(local.reshape(part.nodes.shape), part.shapes, part.areas, part.normals, len(nodes))
    unknowns = np.flatnonzero(~body.fixed[nodes].ravel())
    all_unknowns = (3 * nodes[:, None] + np.arange(3)).ravel()
    kept = np.searchsorted(body.system.free, all_unknowns[unknowns])
    return Patch(points, nodes, surface, unknowns, kept)
