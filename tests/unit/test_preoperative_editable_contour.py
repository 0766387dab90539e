"""Outlines as control points, against shapes whose area is known."""

import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.preoperative.correction.editable_contour import EditableContour, contours_of
from preoperative_shapes import dice

SPACING = np.array([0.8, 0.6])
SHAPE = (120, 140)


def ellipse(count: int) -> np.ndarray:
    angles = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    return np.stack([48.0 + 30.0 * np.sin(angles), 42.0 + 20.0 * np.cos(angles)], axis=1)


def ellipse_mask() -> np.ndarray:
    rows, columns = np.indices(SHAPE)
    return ((rows * SPACING[0] - 48.0) / 30.0) ** 2 + ((columns * SPACING[1] - 42.0) / 20.0) ** 2 < 1.0


def test_the_spline_converges_to_the_ellipse_with_more_control_points():
    away = []
    for count in (12, 24, 48):
        outline = EditableContour(ellipse(count)).outline_mm(0.05)
        away.append(np.abs(np.hypot((outline[:, 0] - 48.0) / 30.0, (outline[:, 1] - 42.0) / 20.0) - 1.0).max())
    assert away[0] < 0.02
    # Of fourth order where chords stand for lengths evenly, of third where they do not quite.
    assert (np.log2(np.array(away[:-1]) / away[1:]) > 2.5).all()
    mask = EditableContour(ellipse(24)).mask(SHAPE, SPACING)
    assert dice(mask, ellipse_mask()) > 0.998


def test_few_control_points_follow_a_mask():
    contours = contours_of(ellipse_mask(), SPACING, 0.5)
    assert len(contours) == 1
    assert len(contours[0].points_mm) <= 24
    assert dice(contours[0].mask(SHAPE, SPACING), ellipse_mask()) > 0.985


def test_every_part_has_an_outline_and_a_hole_has_none():
    mask = ellipse_mask()
    mask[55:65, 65:75] = False
    mask[2:12, 2:10] = True
    contours = contours_of(mask, SPACING, 0.4)
    assert len(contours) == 2
    assert contours[0].mask(SHAPE, SPACING)[60, 70]
    assert contours[1].points_mm.mean(axis=0) == pytest.approx([6.5 * 0.8, 5.5 * 0.6], abs=0.5)
    whole = np.ones((10, 12), dtype=bool)
    assert dice(contours_of(whole, SPACING, 0.3)[0].mask((10, 12), SPACING), whole) > 0.95
    assert contours_of(np.zeros(SHAPE, dtype=bool), SPACING, 0.5) == ()


def test_points_are_moved_inserted_and_removed():
    contour = EditableContour(ellipse(8))
    pulled = contour.moved(0, np.array([48.0, 70.0]))
    assert pulled.points_mm[0] == pytest.approx([48.0, 70.0])
    assert contour.points_mm[0] == pytest.approx([48.0, 62.0])
    assert pulled.mask(SHAPE, SPACING).sum() > contour.mask(SHAPE, SPACING).sum()
    for between in range(8):
        angle = 2.0 * np.pi * (between + 0.4) / 8.0
        place = np.array([48.0 + 31.0 * np.sin(angle), 42.0 + 21.0 * np.cos(angle)])
        more = contour.inserted(place)
        assert len(more.points_mm) == 9
        np.testing.assert_array_equal(more.points_mm[between + 1], place)
        np.testing.assert_array_equal(more.removed(between + 1).points_mm, contour.points_mm)


def test_too_few_points_are_told():
    with pytest.raises(BadInput, match="three or more control points"):
        EditableContour(ellipse(3)).removed(0)
    with pytest.raises(BadInput, match="all finite"):
        EditableContour(np.full((4, 2), np.nan))
