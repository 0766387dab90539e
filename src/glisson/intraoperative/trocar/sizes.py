"""Whether crosses that contradict a layout fit to it with another size, as when a printer has scaled the page."""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize_scalar

from glisson.intraoperative.trocar.corners import SeenCorners
from glisson.intraoperative.trocar.pose import global_pose

_RANGE = (0.4, 2.5)
_STEPS = 24
_SAME = 0.002
"""Paper and rulers differ by as much."""

_BETTER = 0.1
"""Another size is told where it leaves less than this share of the squared error."""


def other_size(seen: SeenCorners) -> float | None:
    """Factor to the size of all crosses with which one pose explains the corners; None where that does not help.

    Needs all of two crosses at least.
    """
    whole = [number for number in seen.crosses if (seen.cross == number).sum() == 12]
    if len(whole) < 2:
        return None
    seen = seen.of(np.isin(seen.cross, whole))
    middles = np.zeros_like(seen.points_mm)
    for number in whole:
        rows = seen.cross == number
        middles[rows] = seen.points_mm[rows].mean(axis=0)

    def left(size: float) -> float:
        """Mean squared error with crosses of another size, the worst tenth left out."""
        pose = global_pose(replace(seen, points_mm=middles + size * (seen.points_mm - middles)))
        return np.inf if pose is None else float(np.sort(pose.squares)[: int(0.9 * len(seen))].mean())

    sizes = np.geomspace(*_RANGE, _STEPS)
    errors = [left(size) for size in sizes]
    best = int(np.argmin(errors))
    if not 0 < best < _STEPS - 1:
        return None
    found = minimize_scalar(left, bounds=(sizes[best - 1], sizes[best + 1]), method="bounded", options={"xatol": 1e-4})
    as_said = left(1.0)
    return float(found.x) if found.fun < _BETTER * as_said and abs(found.x - 1.0) > _SAME else None
