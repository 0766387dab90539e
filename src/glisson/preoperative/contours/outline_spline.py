"""The cubic spline through points of an outline, as points at even distances."""

import numpy as np
from scipy.interpolate import CubicSpline

from glisson.core.arrays import FloatArray

_FEWEST = 8  # points of a spline
_SAME = 1e-9  # of the length


def spread_evenly(points_mm: FloatArray, spacing_mm: float, closed: bool) -> FloatArray:
    """Points (m, 2) at about that distance on the cubic spline through points (n, 2); a double click counts once."""
    knots = np.vstack([points_mm, points_mm[:1]]) if closed else points_mm
    places = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(knots, axis=0), axis=1))])
    different = np.append(np.diff(places) > _SAME * places[-1], True)
    spline = CubicSpline(places[different], knots[different], bc_type="periodic" if closed else "natural")
    count = max(round(places[-1] / spacing_mm), _FEWEST)
    even: FloatArray = spline(np.linspace(0.0, places[-1], count + 1))
    return even[:-1] if closed else even
