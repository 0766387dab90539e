"""Slices drawn in a mask, on livers of the phantom family whose automatic masks are wrong in known ways."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy import ndimage

from glisson.core import Grid, Volume
from glisson.core.errors import BadInput
from glisson.framework.segmentation_scores import SegmentationScores, segmentation_scores
from glisson.phantom.appearance import Appearance, draw_ct, draw_mr
from glisson.phantom.family import make_phantom
from glisson.phantom.liver_shape import build_shape
from glisson.phantom.proportions import draw_proportions
from glisson.preoperative.contours.signed_distance import signed_distance_of_mask
from glisson.preoperative.correction.correcting import Correcting
from glisson.preoperative.correction.drawn_slices import DrawnSlices
from preoperative_shapes import dice

MM = 3.0
MEMBERS = range(401, 409)

Liver = tuple[np.ndarray, np.ndarray, Grid]


@pytest.fixture(scope="module")
def livers() -> list[Liver]:
    """Automatic mask, true mask and grid of each member."""
    return [liver(member) for member in MEMBERS]


def liver(member: int) -> Liver:
    solid = build_shape(draw_proportions(member)).liver
    low = solid.bounds[0] - 24.0
    shape = np.ceil((solid.bounds[1] + 24.0 - low) / MM).astype(int)
    grid = Grid((int(shape[0]), int(shape[1]), int(shape[2])), [MM, MM, MM], low)
    places = grid.points_from_indices(np.moveaxis(np.indices(grid.shape), 0, -1).reshape(-1, 3)).reshape(*shape, 3)
    true = solid.distance(places) < 0.0
    return wrong(true, places, np.random.default_rng(member)), true, grid


def wrong(true: np.ndarray, places: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """The border moved by some 1.5 mm in waves of some 30 mm, two leaks and a missing piece of 14 to 22 mm radius."""
    away = ndimage.distance_transform_edt(~true, sampling=MM) - ndimage.distance_transform_edt(true, sampling=MM)
    wave = ndimage.gaussian_filter(random.standard_normal(true.shape), 12.0 / MM)
    mask = away < 1.5 * wave / wave.std()
    border = places[true & ~ndimage.binary_erosion(true)]
    for is_leak in (True, False, True):
        ball = ((places - border[random.integers(len(border))]) ** 2).sum(axis=-1) < random.uniform(14.0, 22.0) ** 2
        mask = mask | ball if is_leak else mask & ~ball
    return mask


def scores_of(masks: list[np.ndarray], livers: list[Liver]) -> list[SegmentationScores]:
    return [segmentation_scores(mask, true, grid) for mask, (_, true, grid) in zip(masks, livers, strict=True)]


def one_after_the_other(automatic: np.ndarray, true: np.ndarray, grid: Grid) -> np.ndarray:
    """A tenth of the slices is drawn as they truly are, each where it is suggested after those before."""
    correcting = Correcting(automatic, grid.spacing_mm)
    for _ in range(round(0.1 * true.any(axis=(0, 1)).sum())):
        number = correcting.suggest()
        correcting.correct(number, true[:, :, number])
    return correcting.mask


def test_a_tenth_of_the_slices_mends_much_of_what_is_wrong(livers: list[Liver]) -> None:
    before = np.array([s.dice for s in scores_of([automatic for automatic, _, _ in livers], livers)])
    after = np.array([s.dice for s in scores_of([one_after_the_other(*one) for one in livers], livers)])
    assert np.median((1.0 - after) / (1.0 - before)) < 0.6
    assert (after > before).all()


def test_six_contours_at_even_distances_are_followed(livers: list[Liver]) -> None:
    """The dissertation's groups of slices, a contour on the middle of each."""
    masks = []
    for automatic, true, grid in livers:
        own = np.flatnonzero(true.any(axis=(0, 1)))
        contours = np.zeros_like(true)
        middles = np.linspace(own[0], own[-1] + 1, 13)[1::2].astype(int)
        contours[:, :, middles] = true[:, :, middles]
        masks.append(DrawnSlices(automatic, contours, None, grid).mask)
        np.testing.assert_array_equal(masks[-1][:, :, middles], true[:, :, middles])
    before, after = scores_of([automatic for automatic, _, _ in livers], livers), scores_of(masks, livers)
    assert all(a.dice > b.dice for a, b in zip(after, before, strict=True))
    assert np.median([a.asd_mm for a in after]) < np.median([b.asd_mm for b in before])


@pytest.mark.parametrize(("member", "draw"), [(300, draw_ct), (301, draw_ct), (304, draw_mr)])
def test_the_scan_teaches_more_than_the_shape(member: int, draw: Callable[[int], Appearance]) -> None:
    """Six slices drawn of a mask that wanders: too small here, too large there."""
    phantom = make_phantom(member, (2.5, 2.5, 3.0), appearance=draw(member))
    true, grid = phantom.organ.mask("liver"), phantom.volume.grid
    wander = ndimage.gaussian_filter(np.random.default_rng(member).normal(size=true.shape), 5.0)
    automatic = signed_distance_of_mask(true, grid.spacing_mm) < 5.0 * wander / wander.std()
    own = np.flatnonzero(true.any(axis=(0, 1)))
    middles = np.linspace(own[0], own[-1] + 1, 13)[1::2].astype(int).tolist()
    slices = DrawnSlices(automatic, true, middles, grid)
    followed = slices.followed(phantom.volume)
    assert 1.0 - dice(followed, true) < 0.5 * (1.0 - dice(slices.mask, true))
    np.testing.assert_array_equal(followed[:, :, middles], true[:, :, middles])


def test_two_drawn_slices_teach_shape_only(livers: list[Liver]) -> None:
    automatic, true, grid = livers[0]
    slices = DrawnSlices(automatic, true, (20, 30), grid)
    nothing = Volume(np.zeros(grid.shape, dtype=np.int16), grid)
    np.testing.assert_array_equal(slices.followed(nothing), slices.mask)


def test_the_way_a_scan_is_stored_does_not_matter(livers: list[Liver]) -> None:
    """Slices along the first array axis, from head to feet."""
    automatic, true, grid = livers[0]
    last = grid.shape[2] - 1
    turned = Grid(
        (grid.shape[2], grid.shape[0], grid.shape[1]),
        grid.spacing_mm,
        grid.points_from_indices(np.array([[0, 0, last]]))[0],
        np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
    )
    straight = DrawnSlices(automatic, true, (20, 30), grid)
    other = DrawnSlices(*(mask.transpose(2, 0, 1)[::-1] for mask in (automatic, true)), (last - 20, last - 30), turned)
    # Where both sides say exactly zero, rounding decides.
    assert dice(other.mask[::-1].transpose(1, 2, 0), straight.mask) > 0.999


def test_suggestions_change_nothing_and_keep_away_from_what_is_drawn(livers: list[Liver]) -> None:
    automatic, true, grid = livers[0]
    slices = DrawnSlices(automatic, true, (20, 30), grid)
    before = slices.mask
    suggested = slices.suggested(5)
    assert len({*suggested, 20, 30}) == 7
    assert slices.numbers == (20, 30)
    np.testing.assert_array_equal(slices.mask, before)


def test_a_number_without_a_slice_is_told(livers: list[Liver]) -> None:
    automatic, true, grid = livers[0]
    with pytest.raises(BadInput, match="no slice 900; the scan's are 0 to"):
        DrawnSlices(automatic, true, (900,), grid)
