"""Contact against the IPC Toolkit (ipctk), which knows neither our distances nor our quadrature points.

Our contact acts at quadrature points, near a lever about a third of its edge's radius apart, and a report's least gap
is the least at these points; ipctk sees the whole surface, finely triangulated. Its least gap may be smaller by as much
as the surface nears the tool in between: over a rounded edge of radius R, r mm from the nearest point, a flat face
nears it by up to r² / 2R.
"""

from dataclasses import dataclass
from functools import cache
from math import pi, radians

import ipctk
import numpy as np
import pytest
from lifts import lift, slab, slab_lever
from triangles import organ_surface

from glisson.core import Lever, LeverDrive, Status
from glisson.core.deformation import ContactReport
from glisson.core.mesh import TriangleSurface
from glisson.mechanics.lever_tool import LeverTool
from glisson.studies.contact.tool_surfaces import lever_surface

ipctk.set_num_threads(1)

PARTS = 24  # of every side of a face
REACH_MM = 0.2  # more than any least gap
INSET_MM = 1.0
"""From a tool with its surface that much further inside, ipctk also measures how deep an organ lies in the tool."""
ROUNDS = 10  # of bisection, to a thousandth of a small triangle
NEARER_MM = 0.01
"""How much nearer than its quadrature points the surface may come: a tenth of the cushion. `WIDE` comes 0.003 mm."""


@dataclass(frozen=True)
class Lift:
    """Where the lever lies across the slab and how wide it is (mm), its angle, and the cubes of the mesh.

    Levers start 0.2 mm under the slab. One that starts in touch takes the scanned surface to lie up to a cushion's
    range (0.1 mm) further out, see `settle_gaps`; its reported gaps are not those of the scanned surface.
    """

    across: float
    width_mm: float
    angle_deg: float
    counts: tuple[int, int, int]


WIDE = Lift(25.0, 60.0, 20.0, (8, 3, 2))
ALONG = Lift(15.0, 25.0, 10.0, (8, 6, 2))
"""Narrow and off-centre; element edges (25 mm across) run along the lever's rounded edge (24.5 to 27.5 mm)."""
ACROSS = Lift(10.0, 25.0, 10.0, (8, 3, 2))
"""Narrow and off-centre; the lever's rounded edge (19.5 to 22.5 mm) runs through the middle of 16.7 mm wide faces.

With 16 points on each face, whatever its size, the edge lay up to 0.43 mm inside such faces.
"""
LIFTS = {"wide": WIDE, "along": ALONG, "across": ACROSS}


@dataclass(frozen=True)
class Lifted:
    """The end of a lift: the organ's triangles, how far they are off its surface (mm), and the lever's report."""

    lever: Lever
    angle_deg: float
    organ: TriangleSurface
    chord_mm: float
    report: ContactReport


class Pair:
    """Two surfaces for ipctk, neither of which is tested against itself."""

    def __init__(self, first: TriangleSurface, second: TriangleSurface) -> None:
        counts = [len(first.vertices), len(second.vertices)]
        triangles = np.vstack([first.triangles, second.triangles + counts[0]])
        triangles = np.asfortranarray(triangles.astype(np.int32))
        self._vertices = np.asfortranarray(np.vstack([first.vertices, second.vertices]))
        self._mesh = ipctk.CollisionMesh(self._vertices, ipctk.edges(triangles), triangles)
        self._mesh.can_collide = ipctk.make_vertex_patches_filter(np.repeat([0, 1], counts).astype(np.int32))

    @property
    def intersects(self) -> bool:
        return ipctk.has_intersections(self._mesh, self._vertices)

    def distance(self, reach_mm: float) -> float:
        """Least distance in mm of a vertex from a face or of two edges, which must be within reach."""
        collisions = ipctk.NormalCollisions()
        collisions.build(self._mesh, self._vertices, reach_mm)
        assert len(collisions) > 0
        return float(np.sqrt(collisions.compute_minimum_distance(self._mesh, self._vertices)))  # it gives the square


@cache
def _lifted(case: Lift) -> Lifted:
    lever = slab_lever(case.across, -0.2, case.width_mm)
    answer = lift(slab(7.0, case.counts), LeverDrive("lever", case.angle_deg), lever, cohesion_kpa=0.0)
    if answer.status is not Status.CONVERGED:
        raise RuntimeError(answer.message)
    report = next(r for r in answer.stages[-1].contacts if r.tool == "lever")
    organ, chord = organ_surface(answer.mesh, answer.mesh.moved(answer.displacement), PARTS)
    return Lifted(lever, case.angle_deg, organ, chord, report)


def _our_least_gap(end: Lifted) -> tuple[float, float]:
    """Bounds of the least gap over all of the organ's triangles, by our distance and gradient; branch and bound.

    The gap g to a convex body is convex, so with its gradients n at the corners x of a triangle it is at least
    Σ λa (ga + na · (x − xa)) = Σ λa ga − Σ λa λb (na − nb) · (xa − xb), the last sum over the three sides.
    """
    tool = LeverTool(end.lever)
    rotation, translation = tool.pose(radians(end.angle_deg))
    corners = ((end.organ.vertices - translation) @ rotation)[end.organ.triangles]
    most = np.inf
    for _ in range(ROUNDS):
        gaps, normals = tool.distance(corners.reshape(-1, 3)), tool.derivatives(corners.reshape(-1, 3))[0]
        gaps, sides = gaps.reshape(-1, 3), np.roll(corners, 1, axis=1) - corners
        assert gaps.min() > -end.lever.edge_radius_mm  # deeper inside, our distance is not convex
        turns = np.roll(normals.reshape(-1, 3, 3), 1, axis=1) - normals.reshape(-1, 3, 3)
        bounds = gaps.min(axis=1) - np.einsum("tsi,tsi->ts", turns, sides).max(axis=1) / 3.0  # Σ λa λb ≤ 1/3
        most = min(most, float(gaps.min()))
        corners = _quartered(corners[bounds <= most])
    return float(bounds.min()), most


def _quartered(corners):
    """Triangles (t, 3, 3), each cut in four."""
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    tips = [np.stack([corners[:, n], middles[:, n], middles[:, n - 1]], axis=1) for n in range(3)]
    return np.concatenate([*tips, middles])


def _may_be_nested(first: TriangleSurface, second: TriangleSurface) -> bool:
    """Whether the bounding box of one contains that of the other."""
    (a, b), (c, d) = ((s.vertices.min(axis=0), s.vertices.max(axis=0)) for s in (first, second))
    return bool((np.all(a <= c) and np.all(d <= b)) or (np.all(c <= a) and np.all(b <= d)))


def test_the_triangles_of_a_lever_are_its_rounded_box() -> None:
    surface, chord = lever_surface(slab_lever(), 10.0)
    assert surface.is_closed
    assert chord < 0.01
    sides, radius = np.array([70.0, 8.0, 25.0]) - 6.0, 3.0
    flat, edges = 2.0 * sides @ np.roll(sides, 1), sides.sum()
    # Steiner's formula for the box of these sides, grown by the radius.
    volume = sides.prod() + flat * radius + pi * edges * radius**2 + 4.0 / 3.0 * pi * radius**3
    area = flat + 2.0 * pi * edges * radius + 4.0 * pi * radius**2
    assert 0.0 < volume - surface.volume_mm3 < chord * area


@pytest.mark.parametrize("name", LIFTS)
def test_our_distance_is_that_of_ipctk(name: str) -> None:
    """Over the same triangles of the organ, outside the lever and inside; the lever's are at most a chord off."""
    end = _lifted(LIFTS[name])
    assert end.organ.is_closed
    tool, chord = lever_surface(end.lever, end.angle_deg, INSET_MM)
    pair = Pair(end.organ, tool)
    assert not pair.intersects
    gap = pair.distance(INSET_MM + REACH_MM) - INSET_MM
    low, high = _our_least_gap(end)
    assert high - low < 1e-4
    assert low - 1e-9 < gap < high + chord


@pytest.mark.parametrize("name", LIFTS)
def test_the_reported_gap_is_that_of_the_surfaces(name: str) -> None:
    end = _lifted(LIFTS[name])
    tool, chord = lever_surface(end.lever, end.angle_deg)
    pair = Pair(end.organ, tool)
    assert not pair.intersects
    assert not _may_be_nested(end.organ, tool)
    gap = pair.distance(REACH_MM)
    assert gap < end.report.least_gap_mm + chord + end.chord_mm
    assert gap > end.report.least_gap_mm - NEARER_MM
