"""The guide wire in B: it keeps its length and is held at the duct's mouth."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.structures import Curve
from glisson.geometry.mapping import PointMap
from glisson.geometry.wire import Wire

_STEP_MM = 1.0


def carried_wire(duct: Curve, length_mm: float, point_map: PointMap) -> tuple[Wire, float]:
    """The wire in B and its slide in mm.

    The wire keeps its length and is held at the duct's mouth, so it fills the first `length_mm` of the
    deformed duct. The slide is its tip's motion past the tissue, *positive inward*: what the duct between
    the mouth and the tip's material point of A has shortened.
    """
    in_a = Wire(duct.points_mm, max(duct.length_mm, length_mm))
    whole = float(in_a.length_mm)
    arcs = np.unique(np.concatenate([_ladder(whole), duct.arc_lengths_mm, [length_mm]]))
    carried = Curve(point_map.forward(in_a.at(arcs)))
    slide = length_mm - float(carried.arc_lengths_mm[np.searchsorted(arcs, length_mm)])
    return Wire(carried.points_mm, length_mm), slide


def _ladder(length_mm: float) -> FloatArray:
    return np.linspace(0.0, length_mm, max(2, int(np.ceil(length_mm / _STEP_MM)) + 1))
