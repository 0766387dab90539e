"""The resection plane: by the rule, and as material that the deformation carries along."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TriangleSurface
from glisson.core.structures import Plane
from glisson.geometry.mapping import PointMap
from glisson.geometry.planes import fit_plane, plane_basis
from glisson.geometry.wire import Wire

FAR_MM = 20.0
"""A wire that stays farther than this from the tumour is worth a sentence."""

_GRID_MM = 3.0
_FEWEST_POINTS = 30


@dataclass(frozen=True, eq=False)
class RulePlane:
    """A plane by the rule, and sentences about what had to be assumed."""

    plane: Plane
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class CarriedPlane:
    """The plane refitted in B to its material points (n, 3), and their RMS distance from it, mm."""

    plane: Plane
    residual_mm: float
    points_mm: FloatArray


def rule_plane(wire: Wire, surface: TriangleSurface, distance_mm: float) -> RulePlane:
    """The plane perpendicular to the wire, `distance_mm` from the tumour's surface towards the hilum.

    Definition (dissertation, section 4.4): every vertex of the tumour's surface is projected onto the
    wire, that is, given the arc length of the wire's nearest point, arc length 0 being the duct's mouth.
    The least of these is the tumour's most hilar extent. From there the plane stands `distance_mm` of
    arc length further towards the mouth, perpendicular to the wire's tangent there. Its normal points
    inward, towards the tumour's side, which is removed. Vertices whose nearest point is an end of the wire
    are projected onto its straight extension by the end tangent; where the plane rests on an extension,
    a note says so.
    """
    arcs, distances = wire.project(surface.vertices)
    nearest = float(arcs.min())
    where = nearest - distance_mm
    notes = []
    if nearest > wire.length_mm:
        notes.append(
            f"The wire ends {nearest - wire.length_mm:.1f} mm before the tumour; for the plane it was "
            "extended straight by its end tangent."
        )
    if float(distances.min()) > FAR_MM:
        notes.append(
            f"The wire never comes nearer to the tumour than {distances.min():.0f} mm, so the plane by the rule "
            "is only loosely tied to the tumour."
        )
    if where < 0.0:
        begins = f"{nearest:.1f} mm inward of" if nearest >= 0.0 else f"{-nearest:.1f} mm outward of"
        notes.append(
            f"The tumour begins {begins} the duct's mouth, too near for the rule's {distance_mm:g} mm; for the plane "
            "the wire was extended straight by its first tangent."
        )
    return RulePlane(Plane(wire.at(where)[0], wire.tangent(where)), tuple(notes))


def carry_plane(plane: Plane, point_map: PointMap) -> CarriedPlane | None:
    """Carry the plane's material points inside the organ from A to B and refit; None where it misses the organ.

    The points are a square grid over the plane's cross-section with the mesh, 3 mm apart (finer where that
    gives fewer than 30), so the fit weighs equal areas of A equally.
    """
    points = _cross_section(plane, point_map)
    if len(points) < 3:
        return None
    carried = point_map.forward(points)
    # The side that is removed goes along with the tissue just beyond the plane.
    beyond = point_map.forward(points + plane.normal) - carried
    fit = fit_plane(carried, towards=beyond.mean(axis=0))
    return CarriedPlane(fit.plane, fit.rms_mm, carried)


def _cross_section(plane: Plane, point_map: PointMap) -> FloatArray:
    u, v = plane_basis(plane)
    nodes = point_map.mesh.nodes - plane.point_mm
    reach = np.stack([nodes @ u, nodes @ v], axis=1)
    spacing = _GRID_MM
    found = np.zeros((0, 3))
    while len(found) < _FEWEST_POINTS and spacing > 0.1:
        lines = [np.arange(np.floor(r.min() / spacing), np.ceil(r.max() / spacing) + 1) * spacing for r in reach.T]
        a, b = np.meshgrid(*lines, indexing="ij")
        grid = plane.point_mm + a.reshape(-1, 1) * u + b.reshape(-1, 1) * v
        found = grid[point_map.locate(grid).distance_mm == 0.0]
        spacing /= 2.0
    return found
