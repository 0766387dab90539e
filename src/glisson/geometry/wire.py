"""The guide wire: a curve of fixed length in the bile duct, measured from the duct's mouth inward."""

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.structures import Curve

CHORD_MM = 3.0
"""Half the chord whose direction stands for the tangent: it evens out voxel steps of a traced wire, and
the chord of a circle is parallel to the tangent at its middle."""

_EXTENSION_MM = 1000.0
_REPEAT_MM = 1e-6
"""Points of a curve that are no farther apart than this are one point."""


class Wire:
    """A curve by arc length (mm) from the mouth, going on straight along its end tangents.

    Negative arc lengths lie before the mouth, those beyond `length_mm` behind the tip.
    """

    def __init__(self, points_mm: FloatArray, length_mm: float) -> None:
        """The first `length_mm` of the polyline (n, 3); extended by its end tangent where it is shorter.

        Raises:
            BadInput: the length is not positive.
        """
        if not length_mm > _REPEAT_MM:
            raise BadInput(f"The wire's length must be positive, not {length_mm} mm.")
        whole = _without_repeats(points_mm)
        self.length_mm = float(length_mm)
        if length_mm < whole.length_mm:
            inner = whole.arc_lengths_mm < length_mm - _REPEAT_MM
            tip = _at(whole.arc_lengths_mm, whole.points_mm, np.array([length_mm]))
            whole = Curve(np.vstack([whole.points_mm[inner], tip]))
        start, end = _end_tangents(whole)
        first, last = whole.points_mm[0], whole.points_mm[-1]
        self._arcs = np.concatenate([[-_EXTENSION_MM], whole.arc_lengths_mm, [whole.length_mm + _EXTENSION_MM]])
        self._rows = np.vstack([first - _EXTENSION_MM * start, whole.points_mm, last + _EXTENSION_MM * end])

    @property
    def points_mm(self) -> FloatArray:
        """The wire from mouth to tip as a polyline (n, 3)."""
        inner = (self._arcs > _REPEAT_MM) & (self._arcs < self.length_mm - _REPEAT_MM)
        return np.vstack([self.at(0.0), self._rows[inner], self.at(self.length_mm)])

    def at(self, arc_mm: ArrayLike) -> FloatArray:
        """Points (n, 3) at arc lengths (n,)."""
        return _at(self._arcs, self._rows, np.atleast_1d(np.asarray(arc_mm, dtype=np.float64)))

    def tangent(self, arc_mm: float) -> FloatArray:
        """Unit tangent (3,) pointing inward at an arc length: the chord over ± `CHORD_MM`."""
        chord = self.at(arc_mm + CHORD_MM)[0] - self.at(arc_mm - CHORD_MM)[0]
        direction: FloatArray = chord / np.linalg.norm(chord)
        return direction

    def project(self, points_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Arc length (n,) of the wire's point nearest to each of (n, 3), and the distance (n,).

        Only where that nearest point is an end of the wire does its straight extension count, so a wire
        that curves is not short-cut by an extension that passes by.
        """
        nodes = self.points_mm
        marks = Curve(nodes).arc_lengths_mm
        arcs, least = np.zeros(len(points_mm)), np.full(len(points_mm), np.inf)
        for segment, (start, step) in enumerate(zip(nodes[:-1], np.diff(nodes, axis=0), strict=True)):
            offset = points_mm - start
            share = np.clip(offset @ step / (step @ step), 0.0, 1.0)
            distance = np.linalg.norm(offset - share[:, None] * step, axis=1)
            nearer = distance < least
            arcs[nearer] = marks[segment] + share[nearer] * (marks[segment + 1] - marks[segment])
            least = np.minimum(least, distance)
        before, behind = arcs <= 0.0, arcs >= marks[-1]
        first, last = self._rows[1] - self._rows[0], self._rows[-1] - self._rows[-2]
        arcs[before] = np.minimum((points_mm[before] - nodes[0]) @ first / np.linalg.norm(first), 0.0)
        beyond = np.maximum((points_mm[behind] - nodes[-1]) @ last / np.linalg.norm(last), 0.0)
        arcs[behind] = self.length_mm + beyond
        ends = before | behind
        least[ends] = np.linalg.norm(points_mm[ends] - self.at(arcs[ends]), axis=1)
        return arcs, least


def _without_repeats(points_mm: FloatArray) -> Curve:
    """The polyline without points that repeat their predecessor, whose segments would have no direction."""
    steps = np.linalg.norm(np.diff(points_mm, axis=0), axis=1)
    return Curve(points_mm[np.concatenate([[True], steps > _REPEAT_MM])])


def _at(arcs: FloatArray, rows: FloatArray, where: FloatArray) -> FloatArray:
    return np.stack([np.interp(where, arcs, rows[:, axis]) for axis in range(3)], axis=1)


def _end_tangents(curve: Curve) -> tuple[FloatArray, FloatArray]:
    """Unit chords (3,), (3,) over the first and the last `CHORD_MM`, both pointing inward."""
    arcs, reach = curve.arc_lengths_mm, min(CHORD_MM, curve.length_mm)
    first, early, late, last = _at(
        arcs, curve.points_mm, np.array([0.0, reach, curve.length_mm - reach, curve.length_mm])
    )
    return (early - first) / np.linalg.norm(early - first), (last - late) / np.linalg.norm(last - late)
