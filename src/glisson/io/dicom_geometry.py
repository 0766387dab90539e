"""From slices to a grid: they are ordered by where they lie, never by name or number.

A slice's place is its position projected on the normal of the image plane. Everything that would make a
regular grid a lie is refused: mixed orientations or pixel spacings, gaps, duplicates, uneven steps, tilt.
"""

import numpy as np

from glisson.core import BadInput, Grid
from glisson.core.arrays import FloatArray
from glisson.io.dicom_headers import Slice

_AXIS_TOLERANCE = 1e-3
_SPACING_TOLERANCE = 1e-4
_PLACE_TOLERANCE_MM = 0.1
"""Largest distance of a slice from its place in the regular grid: positions are often rounded to 0.1 mm."""

_TILT_TOLERANCE_MM = 0.2
_SAME_PLACE_MM = 0.01
_GAP = 1.5
"""A step of more than 1.5 usual ones means that a slice is missing."""


def sorted_slices(slices: list[Slice]) -> tuple[list[Slice], Grid]:
    """Slices in the order of their places, and the grid they make; axis k runs along the normal.

    Raises:
        BadInput: they do not make a regular grid; the sentence says where.
    """
    if len(slices) < 2:
        raise BadInput(f"a scan needs at least two slices, but there is {len(slices)}.")
    normal = _common_normal(slices)
    first = slices[0]
    places = np.array([s.position_mm @ normal for s in slices])
    order = np.argsort(places, kind="stable")
    ordered = [slices[int(n)] for n in order]
    places = places[order]
    _refuse_duplicates(ordered, places)
    _refuse_gaps(places)
    step = (places[-1] - places[0]) / (len(places) - 1)
    _refuse_uneven(places, step)
    _refuse_tilt(np.array([s.position_mm for s in ordered]), normal)
    columns, rows = first.shape
    spacing = np.array([*first.spacing_mm, step])
    direction = np.stack([first.row, first.column, normal], axis=1)
    return ordered, Grid((columns, rows, len(ordered)), spacing, ordered[0].position_mm, direction)


def _common_normal(slices: list[Slice]) -> FloatArray:
    first = slices[0]
    for other in slices:
        axes = np.stack([other.row, other.column])
        if not np.allclose(axes @ axes.T, np.eye(2), atol=_AXIS_TOLERANCE):
            raise BadInput(f"the image axes of {_name(other)} are not perpendicular unit vectors.")
        if other.shape != first.shape:
            raise BadInput(
                f"the slices differ in size: {_name(first)} has {first.shape[0]} × {first.shape[1]} pixels, "
                f"{_name(other)} has {other.shape[0]} × {other.shape[1]}."
            )
        if not np.allclose(axes, np.stack([first.row, first.column]), atol=_AXIS_TOLERANCE):
            raise BadInput(
                f"the slices differ in orientation ({_name(first)} and {_name(other)}), for example because a "
                "localizer lies among them; keep those of one orientation."
            )
        if not np.allclose(other.spacing_mm, first.spacing_mm, rtol=_SPACING_TOLERANCE):
            raise BadInput(
                f"the slices differ in pixel spacing: {first.spacing_mm.tolist()} mm in {_name(first)}, "
                f"{other.spacing_mm.tolist()} mm in {_name(other)}."
            )
    normal = np.cross(first.row, first.column)
    unit: FloatArray = normal / np.linalg.norm(normal)
    return unit


def _refuse_duplicates(ordered: list[Slice], places: FloatArray) -> None:
    double = np.flatnonzero(np.diff(places) < _SAME_PLACE_MM)
    if len(double):
        one, other = ordered[double[0]], ordered[double[0] + 1]
        raise BadInput(
            f"{len(double)} slices lie where another one lies (z = {places[double[0]]:.2f}: {_name(one)} and "
            f"{_name(other)}), as when several phases are mixed; keep one slice for each place."
        )


def _refuse_gaps(places: FloatArray) -> None:
    steps = np.diff(places)
    # The lower median: of two different steps the smaller one is the usual one.
    usual = np.sort(steps)[(len(steps) - 1) // 2]
    gaps = np.flatnonzero(steps > _GAP * usual)
    if len(gaps):
        low, high = places[gaps[0]], places[gaps[0] + 1]
        more = f", and {len(gaps) - 1} more gaps" if len(gaps) > 1 else ""
        raise BadInput(
            f"a slice is missing between z = {low:.2f} and z = {high:.2f} mm (the usual step is "
            f"{usual:.2f} mm){more}; complete the series."
        )


def _refuse_uneven(places: FloatArray, step: float) -> None:
    off = np.abs(places - (places[0] + step * np.arange(len(places))))
    if off.max() > _PLACE_TOLERANCE_MM:
        steps = np.diff(places)
        raise BadInput(
            f"the slices are unevenly spaced ({steps.min():.3f} to {steps.max():.3f} mm, worst near "
            f"z = {places[int(off.argmax())]:.2f}); resample the scan to one slice spacing."
        )


def _refuse_tilt(positions: FloatArray, normal: FloatArray) -> None:
    offsets = positions - positions[0]
    along = offsets @ normal
    sideways = np.linalg.norm(offsets - along[:, None] * normal, axis=1)
    if sideways[-1] > _TILT_TOLERANCE_MM:
        angle = np.degrees(np.arctan2(sideways[-1], along[-1]))
        raise BadInput(f"the gantry was tilted by {angle:.1f}°, so the scan is sheared; resample it first.")
    if sideways.max() > _TILT_TOLERANCE_MM:
        raise BadInput(f"the slices are shifted sideways against each other by up to {sideways.max():.2f} mm.")


def _name(slice_: Slice) -> str:
    return slice_.path.name if slice_.frame == 0 else f"{slice_.path.name} frame {slice_.frame + 1}"
