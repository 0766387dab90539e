"""Which unit the coordinates of a mesh file are in: the formats do not say, so the size is looked at."""

from typing import Literal

import numpy as np

from glisson.core import BadInput
from glisson.core.arrays import FloatArray

LengthUnit = Literal["mm", "cm", "m"]

_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
_SMALLEST_MM = 5.0
_LARGEST_MM = 5000.0


def in_millimetres(points: FloatArray, unit: LengthUnit | None) -> FloatArray:
    """Points (n, 3) in mm.

    With `unit` None they are taken as mm if the diagonal of their bounding box is at least 5 mm (no organ
    is smaller) and at most 5 m (no patient is larger).

    Raises:
        BadInput: no points, points that are not finite, an unknown unit, or a size that no organ has.
    """
    if unit is not None and unit not in _MM:
        raise BadInput(f"unknown unit {unit!r}; use one of {list(_MM)}.")
    if not len(points):
        raise BadInput("it has no points.")
    if not np.isfinite(points).all():
        raise BadInput(f"{int((~np.isfinite(points)).any(axis=1).sum())} of its points are not finite.")
    scaled = points * _MM[unit or "mm"]
    diagonal = float(np.linalg.norm(np.ptp(scaled, axis=0)))
    if unit is None and diagonal < _SMALLEST_MM:
        raise BadInput(
            f"it is only {diagonal:.3g} mm large, which looks like metres; pass unit='m' (or 'mm' if it is)."
        )
    if diagonal > _LARGEST_MM:
        raise BadInput(f"it is {diagonal / 1000.0:.3g} m large in {unit or 'mm'}, which no organ is; check the unit.")
    return scaled
