"""A closed outline on a slice as control points that a person moves; a cubic spline runs through them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skimage.draw import polygon2mask
from skimage.measure import find_contours

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.preoperative.contours.outline_spline import spread_evenly

_FEWEST = 4
_GROWTH = 1.25
_MOST = 500
_FINE = 0.25  # of the smaller pixel: how finely the spline is drawn


@dataclass(frozen=True, eq=False)
class EditableContour:
    """Control points (n, 2) in mm along rows and columns from the first pixel's centre, in order around the outline.

    Raises:
        BadInput: there are fewer than three, or one is not finite.
    """

    points_mm: FloatArray

    def __post_init__(self) -> None:
        points = np.array(self.points_mm, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3 or not np.isfinite(points).all():
            raise BadInput(f"An outline needs three or more control points (n, 2), all finite, not {points.shape}.")
        points.flags.writeable = False
        object.__setattr__(self, "points_mm", points)

    def moved(self, number: int, place_mm: FloatArray) -> "EditableContour":
        """With control point `number` at another place (2,)."""
        points = self.points_mm.copy()
        points[number] = place_mm
        return replace(self, points_mm=points)

    def inserted(self, place_mm: FloatArray) -> "EditableContour":
        """With one more control point (2,), between the two next to which the outline passes it."""
        spline = spread_evenly(self.points_mm, _spacing_of(self.points_mm), closed=True)
        nearest = int(np.linalg.norm(spline - place_mm, axis=1).argmin())
        # The control points' own places along the spline, ascending from 0.
        _, places = cKDTree(spline).query(self.points_mm)
        after = int(np.searchsorted(np.sort(places), nearest, side="right"))
        return replace(self, points_mm=np.insert(self.points_mm, after, place_mm, axis=0))

    def removed(self, number: int) -> "EditableContour":
        """Without control point `number`.

        Raises:
            BadInput: only three are left.
        """
        return replace(self, points_mm=np.delete(self.points_mm, number, axis=0))

    def outline_mm(self, spacing_mm: float) -> FloatArray:
        """Points (m, 2) on the spline, at about that distance."""
        return spread_evenly(self.points_mm, spacing_mm, closed=True)

    def mask(self, shape: tuple[int, int], spacing_mm: FloatArray) -> NDArray[np.bool_]:
        """Pixels (row, column) whose centres lie inside; spacing (2,) of rows and columns."""
        spacing = np.asarray(spacing_mm, dtype=np.float64)
        polygon = self.outline_mm(_FINE * float(spacing.min())) / spacing
        inside: NDArray[np.bool_] = polygon2mask(shape, polygon)
        return inside


def contours_of(mask: NDArray[np.bool_], spacing_mm: FloatArray, tolerance_mm: float) -> tuple[EditableContour, ...]:
    """Outlines of a mask's parts (row, column), the longest first, each with as few control points as needed.

    Args:
        mask: pixels; its holes have no outline.
        spacing_mm: of rows and columns (2,).
        tolerance_mm: how far the spline may lie from the border between pixels; 95 % of the outline keep to it.
    """
    spacing = np.asarray(spacing_mm, dtype=np.float64)
    found = []
    padded = np.pad(mask, 1).astype(np.float64)
    for border in find_contours(padded, 0.5):
        points = (border[:-1] - 1.0) * spacing
        if len(points) >= _FEWEST and _area(points) < 0.0:
            found.append(points)
    found.sort(key=len, reverse=True)
    return tuple(_sparse(points, tolerance_mm) for points in found)


def _sparse(border: FloatArray, tolerance_mm: float) -> EditableContour:
    """Control points, evenly along a border (n, 2) of many, more and more until they follow it."""
    count = float(_FEWEST)
    while True:
        chosen = np.linspace(0, len(border), round(count), endpoint=False).astype(int)
        contour = EditableContour(border[chosen])
        away, _ = cKDTree(contour.outline_mm(0.25 * tolerance_mm)).query(border)
        if np.percentile(away, 95.0) <= tolerance_mm or count * _GROWTH > min(len(border), _MOST):
            return contour
        count *= _GROWTH


def _area(points: FloatArray) -> float:
    """Twice the area within a polygon (n, 2), negative where the mask lies inside it and not outside."""
    rows, columns = points.T
    return float(np.sum(rows * np.roll(columns, -1) - columns * np.roll(rows, -1)))


def _spacing_of(points: FloatArray) -> float:
    return 0.02 * float(np.linalg.norm(np.diff(points, axis=0), axis=1).mean())
