"""Corrected slices and those between them, on bodies whose shape is known."""

import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.preoperative.correction.correcting import Correcting
from preoperative_shapes import dice

SPACING = np.array([1.0, 1.0, 2.0])
SHAPE = (80, 80, 41)
ROWS, COLUMNS, SLICES = np.indices(SHAPE)


def cone(slope: float = 0.5) -> np.ndarray:
    """A cone whose radius shrinks from 28 mm by `slope` for each slice."""
    return np.hypot(ROWS - 39.7, COLUMNS - 40.2) < 28.0 - slope * SLICES


def with_leak(true: np.ndarray, slices: slice) -> np.ndarray:
    leaking = true.copy()
    leaking[60:78, 30:50, slices] = True
    return leaking


def corrected(automatic: np.ndarray, true: np.ndarray, numbers: list[int]) -> Correcting:
    correcting = Correcting(automatic, SPACING)
    for number in numbers:
        correcting.correct(number, true[:, :, number])
    return correcting


@pytest.mark.parametrize("slope", [0.35, 0.65])
def test_what_is_wrong_on_both_sides_is_mended_between(slope):
    """A cone's signed distances are linear from slice to slice: their blend is the cone, but for its pixels."""
    true = cone()
    mask = corrected(cone(slope), true, [5, 20, 35]).mask
    away = np.abs(np.hypot(ROWS - 39.7, COLUMNS - 40.2) - 28.0 + 0.5 * SLICES)
    assert away[:, :, 5:36][(mask ^ true)[:, :, 5:36]].max() < SPACING[0]
    np.testing.assert_array_equal(mask[:, :, 20], true[:, :, 20])


@pytest.mark.parametrize("automatic", [with_leak(cone(), slice(3, 38)), cone() & (ROWS < 50)])
def test_a_leak_and_a_gap_that_corrections_show_are_mended_between(automatic):
    true = cone()
    mask = corrected(automatic, true, [5, 20, 35]).mask
    before, after = (dice(found[:, :, 5:36], true[:, :, 5:36]) for found in (automatic, mask))
    assert 1.0 - after < 0.15 * (1.0 - before)


def test_what_no_correction_shows_is_held_in_check():
    """A leak between two corrections gets no farther than an outline may bend: 0.8 mm for each mm to the nearer one."""
    true = cone(0.0)
    mask = corrected(with_leak(true, slice(18, 23)), true, [10, 30]).mask
    away = np.hypot(ROWS - 39.7, COLUMNS - 40.2) - 28.0
    for number in range(18, 23):
        apart = SPACING[2] * min(number - 10, 30 - number)
        assert away[:, :, number][mask[:, :, number]].max() < 0.8 * apart + 1.0


def test_where_the_automatic_mask_is_right_it_stays():
    """A bump between the corrections of which they know nothing."""
    true = cone(0.0)
    true[:, :, 10:14] |= np.hypot(ROWS - 39.7, COLUMNS - 42.2)[:, :, 10:14] < 28.0
    mask = corrected(true, true, [4, 18, 36]).mask
    assert dice(mask, true) > 0.999


def test_a_correction_fades_beyond_the_last_one():
    true = cone(0.0)
    automatic = np.hypot(ROWS - 39.7, COLUMNS - 40.2) < 31.0
    mask = corrected(automatic, true, [20]).mask
    np.testing.assert_array_equal(mask[:, :, 20], true[:, :, 20])
    areas = mask.sum(axis=(0, 1))
    assert (np.diff(areas[20:29]) >= 0).all()
    np.testing.assert_array_equal(mask[:, :, 28:], automatic[:, :, 28:])
    np.testing.assert_array_equal(mask[:, :, :13], automatic[:, :, :13])


def test_an_empty_slice_ends_the_organ():
    true = cone(0.0)
    true[:, :, 30:] = False
    automatic = cone(0.0)
    mask = corrected(automatic, true, [29, 30, 31, 40]).mask
    np.testing.assert_array_equal(mask, true)


def test_undo_goes_back_step_by_step():
    true = cone()
    correcting = Correcting(with_leak(true, slice(8, 33)), SPACING)
    masks = [correcting.mask]
    for number, mask in ((10, true[:, :, 10]), (30, true[:, :, 30]), (10, true[:, :, 12])):
        correcting.correct(number, mask)
        masks.append(correcting.mask)
    for before in masks[-2::-1]:
        assert correcting.undo()
        np.testing.assert_array_equal(correcting.mask, before)
    assert not correcting.undo()
    assert correcting.corrected == ()


def test_suggestions_are_spread_first_and_then_go_where_it_was_wrong():
    true = cone(0.2)
    correcting = Correcting(with_leak(true, slice(20, 30)), SPACING)
    suggested = []
    for _ in range(6):
        suggested.append(correcting.suggest())
        correcting.correct(suggested[-1], true[:, :, suggested[-1]])
    assert suggested[:3] == [6, 20, 34]
    # The leak was seen in slice 20 alone: it may reach up to both neighbours.
    assert all(6 < number < 34 for number in suggested[3:])
    assert len(set(suggested)) == 6
    assert dice(correcting.mask, true) > 0.99


def test_what_does_not_fit_is_told():
    with pytest.raises(BadInput, match="the mask is empty"):
        Correcting(np.zeros((4, 4, 4), dtype=bool), SPACING)
    correcting = Correcting(cone(), SPACING)
    for number, mask in ((41, cone()[:, :, 0]), (3, np.zeros((4, 4), dtype=bool))):
        with pytest.raises(BadInput, match="does not fit a scan"):
            correcting.correct(number, mask)
