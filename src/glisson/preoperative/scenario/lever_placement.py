"""Where a lever goes under a liver's left lobe.

The left lobe is the part of the organ furthest to the patient's left. On a board its underside is flat, in the body it
hangs in the air and slopes: so the bar is laid against the lobe from below, as a plate would come to rest, turned along
and across. A bar that met a slope with its edge alone would cut into the lobe.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.parameters import parameter
from glisson.core.tools import Lever

DOWN = np.array([0.0, 1.0, 0.0])
"""Gravity of a patient who lies on the back, and of the organ on its board (LPS)."""

_GAP_WEIGHT = 8.0
"""How many mm of bar under the lobe a median gap of 1 mm is worth when the hinge is chosen."""

_STEEPEST = np.tan(np.radians(30.0))
"""Largest slopes of the bar at angle 0 in the body, along and across."""

_SAMPLE_MM = 2.0
"""The underside is looked at in points so far apart."""


@dataclass(frozen=True)
class LeverLiftParameters:
    """The lever, how far it goes and how it holds the organ."""

    angle_deg: float = parameter(22.0, "Angle to which the lever is lifted.", 0.0, 60.0)
    friction: float = parameter(0.1, "Coefficient of friction of board and lever.", 0.0, 2.0)
    cohesion_kpa: float = parameter(10.0, "Cohesion in stage 1, kPa; stage 2 has none.", 0.0, 1000.0)
    gas_pressure_kpa: float = parameter(
        0.0, "Pressure of the pneumoperitoneum in both stages, kPa; 12 mmHg are 1.6.", 0.0, 20.0
    )
    lobe_fraction: float = parameter(
        0.25, "The left lobe is at most this fraction of the organ's volume, from its left end.", 0.05, 0.6
    )
    gap_mm: float = parameter(0.75, "Gap between lever and lobe before it is lifted.", 0.0, 10.0)
    width_mm: float = parameter(25.0, "Width of the bar.", 2.0, 200.0)
    thickness_mm: float = parameter(8.0, "Thickness of the bar.", 1.0, 50.0)
    board_depth_mm: float = parameter(
        1.0, "How deep the board may cut the lowest bumps of the scanned surface.", 0.0, 5.0
    )


def place_lever(mesh: TetMesh, parameters: LeverLiftParameters) -> Lever:
    """A lever whose bar touches the left lobe from below all but `gap_mm`, hinge on the medial side.

    Of all hinges within the lobe the one is taken that gives the longest bar close to the lobe. The bar
    lies a little above the lobe's middle (towards the head): in the very middle the lobe could roll to
    either side.

    Raises:
        BadInput: the organ's left part has no underside that a bar could touch.
    """
    centres = mesh.nodes[mesh.corners].mean(axis=1)
    volumes = mesh.corner_volumes_mm3
    medial_limit = _quantile(centres[:, 0], volumes, 1.0 - parameters.lobe_fraction)
    lobe = centres[:, 0] >= medial_limit
    middle = _quantile(centres[lobe, 2], volumes[lobe], 0.6)
    underside = _underside(mesh, middle, parameters.width_mm + 2.0 * _SAMPLE_MM)
    tip = float(underside[:, 0].max()) if len(underside) else medial_limit
    # When the bar is lifted the lower edge of its medial end swings back by thickness × sin(angle).
    margin = parameters.thickness_mm * np.sin(np.radians(parameters.angle_deg)) + parameters.gap_mm + 1.0
    best: tuple[float, float, _Plane] | None = None
    for hinge in np.arange(medial_limit, tip - parameters.width_mm, _SAMPLE_MM):
        beyond = underside[underside[:, 0] >= hinge - margin]
        plane = _resting_plane(beyond, 0.5 * (hinge + tip), middle)
        score = tip - hinge - _GAP_WEIGHT * plane.gap
        if best is None or score > best[0]:
            best = (float(score), float(hinge), plane)
    if best is None:
        raise BadInput(
            f"The left lobe offers no underside of {parameters.width_mm:g} mm for a lever; give the lever in "
            "scenario.toml, or choose a larger lobe_fraction."
        )
    _, hinge, plane = best
    arm = np.array([1.0, plane.along, 0.0])
    up = np.array([plane.along, -1.0, plane.across])
    start = np.array([hinge, plane.height(hinge, middle), middle]) - parameters.gap_mm * up / np.linalg.norm(up)
    return Lever.lifting(
        "lever",
        start,
        arm,
        up,
        length_mm=max(150.0, (tip - hinge) * float(np.linalg.norm(arm)) + 20.0),
        width_mm=parameters.width_mm,
        thickness_mm=parameters.thickness_mm,
        edge_radius_mm=min(3.0, parameters.thickness_mm / 2.0),
    )


@dataclass(frozen=True)
class _Plane:
    """The plane y = offset + along · x + across · z, and the median gap in mm between it and the lobe."""

    offset: float
    along: float
    across: float
    gap: float

    def height(self, x: float, z: float) -> float:
        """Its y."""
        return self.offset + self.along * x + self.across * z


def _resting_plane(points: FloatArray, x: float, z: float) -> _Plane:
    """Where a plate pressed from below at x, z on underside points (n, 3) comes to rest."""
    along, across = np.clip(_hull_slopes(points, x, z), -_STEEPEST, _STEEPEST)
    heights = points[:, 1] - along * points[:, 0] - across * points[:, 2]
    offset = float(heights.max())
    # The lowest point in each slice of the lobe counts.
    slices = np.unique(np.floor(points[:, 0] / _SAMPLE_MM), return_inverse=True)[1]
    lowest = np.full(int(slices.max()) + 1, -np.inf)
    np.maximum.at(lowest, slices, heights)
    return _Plane(offset, float(along), float(across), float(np.median(offset - lowest)))


def _hull_slopes(points: FloatArray, x: float, z: float) -> tuple[float, float]:
    """Slopes dy/dx and dy/dz of the lower side (largest y) of the convex hull at x, z; 0 where it has none."""
    try:
        facets = ConvexHull(points).equations
    except (QhullError, ValueError):
        return 0.0, 0.0
    facets = facets[facets[:, 1] > 1e-9]
    across, down, along, offset = facets[:, 2], facets[:, 1], facets[:, 0], facets[:, 3]
    lowest = int(np.argmin(-(along * x + across * z + offset) / down))
    return float(-along[lowest] / down[lowest]), float(-across[lowest] / down[lowest])


def _underside(mesh: TetMesh, z: float, width_mm: float) -> FloatArray:
    """Points (n, 3) on downward faces within a strip of that width about z, about 2 mm apart."""
    triangles, _ = mesh.boundary()
    corners = mesh.nodes[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    nearby = np.abs(corners[:, :, 2] - z).min(axis=1) <= 0.5 * width_mm
    across = (corners[:, :, 2].min(axis=1) < z) & (corners[:, :, 2].max(axis=1) > z)
    corners = corners[(normals @ DOWN > 0.0) & (nearby | across)]
    if not len(corners):
        return np.zeros((0, 3))
    longest = float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max())
    steps = int(np.ceil(longest / _SAMPLE_MM))
    weights = np.array([(a, b, steps - a - b) for a in range(steps + 1) for b in range(steps + 1 - a)]) / steps
    points = np.einsum("sc,tci->tsi", weights, corners).reshape(-1, 3)
    inside: FloatArray = points[np.abs(points[:, 2] - z) <= 0.5 * width_mm]
    return inside


def _quantile(values: FloatArray, weights: FloatArray, fraction: float) -> float:
    """The value below which that fraction of the weight lies."""
    order = np.argsort(values, kind="stable")
    total = np.cumsum(weights[order])
    return float(values[order][int(np.searchsorted(total, fraction * total[-1]))])
