"""Vessel trees grown inside the organ: main branches given, twigs to scattered targets, Murray's radii.

Radii follow Murray's law (1926), r³ of the parent = sum of r³ of the children, with equal leaves:
r = r_leaf · leaves^(1/3), scaled so that the root has the radius wanted.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.interpolate import CubicSpline

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.structures import VesselTree
from glisson.phantom.implicit import Solid

Allowed = Callable[[FloatArray], bool]
"""Whether a path (n, 3) may be grown."""


def smooth_path(points: FloatArray, step_mm: float) -> FloatArray:
    """A cubic spline through the points (n, 3), sampled about every `step_mm`."""
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    count = max(2, int(np.ceil(chord[-1] / step_mm)) + 1)
    path: FloatArray = CubicSpline(chord, points)(np.linspace(0.0, chord[-1], count))
    return path


class Growth:
    """A tree being grown: points and the parent of each (−1 for the root)."""

    def __init__(self, root: FloatArray) -> None:
        self.points: list[FloatArray] = [np.asarray(root, dtype=np.float64)]
        self.parents: list[int] = [-1]

    def nearest(self, point: FloatArray) -> int:
        """The number of the tree's point nearest to `point`."""
        return int(np.linalg.norm(np.array(self.points) - point, axis=1).argmin())

    def extend(self, start: int, path: FloatArray) -> None:
        """Append a path (n, 3) whose first point is the tree's point `start`."""
        parent = start
        for point in path[1:]:
            self.points.append(point)
            self.parents.append(parent)
            parent = len(self.points) - 1

    def branch(self, controls: Sequence[FloatArray], step_mm: float = 4.0) -> None:
        """A main branch: a smooth path from the tree's nearest point through the control points (3,)."""
        start = self.nearest(controls[0])
        self.extend(start, smooth_path(np.vstack([self.points[start], controls]), step_mm))

    def twig(self, target: FloatArray, random: np.random.Generator, allowed: Allowed, step_mm: float = 6.0) -> None:
        """A slightly bowed branch from the nearest point to the target, unless it leaves what is allowed."""
        start = self.nearest(target)
        along = target - self.points[start]
        if np.linalg.norm(along) < 2.0 * step_mm:
            return
        bow = np.cross(along, random.normal(size=3)) / np.linalg.norm(along)
        middle = self.points[start] + 0.5 * along + 0.12 * np.linalg.norm(along) * bow / max(1.0, np.linalg.norm(bow))
        path = smooth_path(np.vstack([self.points[start], middle, target]), step_mm)
        if allowed(path):
            self.extend(start, path)

    def finish(self, name: str, root_radius_mm: float) -> VesselTree:
        """The tree with radii by Murray's law."""
        parents = np.array(self.parents)
        leaves = _leaves(parents)
        radii = root_radius_mm * np.cbrt(leaves / leaves[0])
        edges: IntArray = np.stack([parents[1:], np.arange(1, len(parents))], axis=1)
        return VesselTree(name, np.array(self.points), radii, edges)


def scattered_targets(
    solid: Solid, depth_mm: float, count: int, random: np.random.Generator, away: Solid | None = None
) -> FloatArray:
    """Evenly scattered points at least `depth_mm` inside the solid, not inside `away`.

    They come from the additive recurrence with the generalised golden ratio (Roberts 2018), shifted at random.
    """
    low, high = solid.bounds
    ratio = 1.2207440846057596  # the real root of x⁴ = x + 1
    steps = np.arange(1, 6 * count + 1)[:, None] / ratio ** np.arange(1.0, 4.0)
    points = low + (high - low) * ((random.uniform(size=3) + steps) % 1.0)
    keep = solid.distance(points) < -depth_mm
    if away is not None:
        keep &= away.distance(points) > 0.0
    chosen: FloatArray = points[keep][:count]
    return chosen


def _leaves(parents: IntArray) -> IntArray:
    """The number of leaves beyond each point (1 for a leaf); parents come before children."""
    leaves = np.ones(len(parents), dtype=np.int64)
    leaves[np.unique(parents[1:])] = 0
    for point in range(len(parents) - 1, 0, -1):
        leaves[parents[point]] += leaves[point]
    return leaves
