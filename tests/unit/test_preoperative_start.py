"""The start without a click, and clicks that correct, on drawn phantoms."""

import numpy as np
import pytest
from scipy import ndimage

from glisson.core import Grid, Volume
from glisson.core.errors import BadInput
from glisson.phantom.appearance import draw_ct, draw_mr
from glisson.phantom.family import make_phantom
from glisson.preoperative.correction.clicked_mask import Click, ClickedMask
from glisson.preoperative.imaging.ct import smoothed_ct
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.fine_border import fine_border
from glisson.preoperative.liver.intensity_prior import IntensityPrior
from glisson.preoperative.liver.seeded_contour import SeededContour, SeededContourParameters
from preoperative_shapes import dice, ellipsoid, mask_of

NO_CLICK = np.zeros((0, 3))
SPACING = (2.5, 2.5, 3.0)


@pytest.mark.parametrize("member", [201, 202, 203, 309])
def test_a_liver_is_found_without_a_click(member: int) -> None:
    """CTs of different phases and noise; heart (309: as bright), spleen, stomach and muscle are not the liver."""
    phantom = make_phantom(member, SPACING, appearance=draw_ct(member))
    found = SeededContour(SeededContourParameters()).segment(phantom.volume, None, NO_CLICK)
    assert dice(found.labels.mask("liver"), phantom.organ.mask("liver")) >= 0.96
    (sentence,) = [reason for _, reason in found.flagged_slices if "without a click" in reason]
    assert "almost as wide" not in sentence


def test_it_matters_little_where_the_click_is() -> None:
    """Clicks into a tumour, a vessel and the border settle where the widest even tissue does."""
    phantom = make_phantom(201, SPACING, appearance=draw_ct(201))
    truth, grid = phantom.organ.mask("liver"), phantom.volume.grid
    depth = ndimage.distance_transform_edt(truth, sampling=SPACING)
    vessels, (tumour, *_) = np.asarray(phantom.volume.voxels) > 160, phantom.tumours.names.values()
    places = {
        "tumour": phantom.tumours.mask(tumour),
        "vessel": vessels & (depth > 15.0),
        "border": truth & (depth < 4.0),
    }
    alone = SeededContour(SeededContourParameters()).segment(phantom.volume, None, NO_CLICK).labels.mask("liver")
    for where, mask in places.items():
        cells = np.argwhere(mask)
        click = grid.points_from_indices(cells[[len(cells) // 2]])
        found = SeededContour(SeededContourParameters()).segment(phantom.volume, None, click).labels.mask("liver")
        assert dice(found, truth) >= dice(alone, truth) - 0.003, where


def test_the_border_is_found_again_in_finer_voxels() -> None:
    """A ball in fat, by steps of 2 mm, comes nearer to itself in voxels of 1 mm."""
    grid = Grid((80, 80, 80), [1.0, 1.0, 1.0], [-39.5, -39.5, -39.5])
    ball = mask_of(ellipsoid((0.3, 0.2, -0.4), (27.0, 24.0, 29.0)), grid)
    noise = np.random.default_rng(5).normal(0.0, 15.0, grid.shape)
    volume = Volume((np.where(ball, 100.0, -90.0) + noise).astype(np.int16), grid)
    working = WorkingGrid.of(grid, 2.0)
    coarse = working.working(ball) >= 0.5
    thin = ndimage.binary_erosion(coarse, ndimage.generate_binary_structure(3, 1))
    for start in (coarse, thin):
        found = fine_border(volume, start, smoothed_ct(volume, working), IntensityPrior(100.0, 4.0), working)
        print(dice(found, ball), dice(working.full(start), ball))
        assert dice(found, ball) > max(0.985, dice(working.full(start), ball))


def two_balls(gap_hu: int) -> tuple[Volume, np.ndarray, np.ndarray]:
    """A liver of 100 HU and a second ball of other HU that touches it by a neck, in fat."""
    grid = Grid((90, 60, 60), [2.0, 2.0, 2.0], [-90.0, -60.0, -60.0])
    liver = mask_of(ellipsoid((-30.0, 0.0, 0.0), (45.0, 45.0, 45.0)), grid)
    other = mask_of(ellipsoid((36.0, 0.0, 0.0), (24.0, 24.0, 24.0)), grid) & ~liver
    voxels = np.select([liver, other], [100, 100 + gap_hu], -90) + np.random.default_rng(3).normal(0, 8, grid.shape)
    return Volume(voxels.astype(np.int16), grid), liver, other


def test_a_click_adds_what_is_missing() -> None:
    volume, liver, other = two_balls(-45)
    clicked = ClickedMask(volume, liver)
    clicked.apply(Click((36.0, 0.0, 0.0), True))
    assert dice(clicked.mask, liver | other) > 0.98
    far = np.indices(liver.shape)[0] < 40
    assert np.array_equal(clicked.mask[far], liver[far])


def test_a_click_takes_away_what_is_too_much() -> None:
    volume, liver, other = two_balls(0)
    clicked = ClickedMask(volume, liver | other)
    clicked.apply(Click((36.0, 0.0, 0.0), False))
    assert dice(clicked.mask, liver) > 0.98
    assert not clicked.mask[other & ~ndimage.binary_dilation(liver, iterations=2)].any()


def test_a_click_that_was_added_is_not_taken_away_with_another() -> None:
    volume, liver, _ = two_balls(0)
    clicked = ClickedMask(volume, liver)
    clicked.apply(Click((36.0, 0.0, 0.0), True))
    clicked.apply(Click((-60.0, 0.0, 20.0), False))
    index = np.rint(volume.grid.indices_from_points(np.array([[36.0, 0.0, 0.0]]))[0]).astype(int)
    assert clicked.mask[tuple(index)]


@pytest.mark.parametrize(
    ("point", "is_organ", "sentence"),
    [
        ((-30.0, 0.0, 0.0), True, "inside the organ already"),
        ((36.0, 0.0, 0.0), False, "outside the organ already"),
        ((900.0, 0.0, 0.0), True, "outside the scan"),
    ],
)
def test_clicks_that_say_nothing_new_are_refused(point, is_organ, sentence) -> None:
    volume, liver, _ = two_balls(-45)
    clicked = ClickedMask(volume, liver)
    with pytest.raises(BadInput, match=sentence):
        clicked.apply(Click(point, is_organ))
    assert np.array_equal(clicked.mask, liver)


@pytest.mark.parametrize("member", [204, 205])
def test_a_liver_is_found_in_an_mr_from_one_click(member: int) -> None:
    """Bright liver, dark vessels and tumours, uneven coil sensitivity, Rician noise, a scale that nobody knows."""
    phantom = make_phantom(member, SPACING, appearance=draw_mr(member))
    truth = phantom.organ.mask("liver")
    cells = np.argwhere(truth)
    click = phantom.volume.grid.points_from_indices(cells[[np.random.default_rng(member).integers(len(cells))]])
    found = SeededContour(SeededContourParameters()).segment(phantom.volume, None, click)
    assert dice(found.labels.mask("liver"), truth) >= 0.93
