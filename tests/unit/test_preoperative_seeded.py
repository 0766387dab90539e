import numpy as np
import pytest

from glisson.core import Grid, LabelMap, Volume
from glisson.phantom.family import make_phantom
from glisson.preoperative.imaging.working_grid import WorkingGrid
from glisson.preoperative.liver.completion import surface_tumours
from glisson.preoperative.liver.intensity_prior import IntensityPrior, estimate_prior
from glisson.preoperative.liver.propagation import SliceContour
from glisson.preoperative.liver.reachable import reachable_region
from glisson.preoperative.liver.seeded_contour import SeededContour, SeededContourParameters
from glisson.preoperative.liver.slice_flags import flag_slices
from preoperative_shapes import dice, ellipsoid, mask_of


@pytest.fixture(scope="module")
def phantom():
    return make_phantom(0, (2.5, 2.5, 3.0))


def click(phantom, seed: int) -> np.ndarray:
    """A click anywhere inside the liver, at random."""
    cells = np.argwhere(phantom.organ.mask("liver"))
    return phantom.volume.grid.points_from_indices(cells[[np.random.default_rng(seed).integers(len(cells))]])


def segment(volume: Volume, seeds: np.ndarray, labels: LabelMap | None = None):
    return SeededContour(SeededContourParameters()).segment(volume, labels, seeds)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_phantom_from_one_click(phantom, seed):
    """The phantom's heart and stomach wall touch the liver and look like it."""
    found = segment(phantom.volume, click(phantom, seed))
    assert dice(found.labels.mask("liver"), phantom.organ.mask("liver")) >= 0.96


def test_the_way_a_scan_is_stored_does_not_matter(phantom):
    """Axes in another order and one of them running backwards: the same mask, voxel for voxel."""
    grid = phantom.volume.grid
    turned = Grid(
        (grid.shape[2], grid.shape[0], grid.shape[1]),
        grid.spacing_mm[[2, 0, 1]],
        grid.points_from_indices(np.array([[0, 0, grid.shape[2] - 1]]))[0],
        np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
    )
    voxels = np.transpose(phantom.volume.voxels, (2, 0, 1))[::-1]
    seed = click(phantom, 1)
    straight = segment(phantom.volume, seed)
    other = segment(Volume(np.ascontiguousarray(voxels), turned), seed)
    back = np.transpose(other.labels.voxels[::-1], (1, 2, 0))
    assert dice(back > 0, straight.labels.voxels > 0) > 0.999
    assert other.labels.grid is turned


def test_known_tumours_belong_to_the_liver(phantom):
    grid = phantom.volume.grid
    edge = mask_of(ellipsoid((-110.0, -30.0, 0.0), (18.0, 18.0, 18.0)), grid)
    labels = LabelMap(edge.astype(np.uint8), grid, {1: "tumour1"})
    found = segment(phantom.volume, click(phantom, 1), labels).labels.mask("liver")
    assert found[edge].all()


def test_prior_is_the_livers_though_the_click_hits_a_vessel():
    rng = np.random.default_rng(0)
    smooth = rng.normal(105.0, 4.0, (60, 60, 60)).astype(np.float32)
    smooth[26:34, 26:34, :] = 170.0
    prior = estimate_prior(smooth, np.ones(3), [(30, 30, 30)])
    assert prior is not None
    assert prior.mean == pytest.approx(105.0, abs=1.0)
    assert prior.deviation == pytest.approx(4.0, rel=0.25)
    assert estimate_prior(np.full((9, 9, 9), -500.0, np.float32), np.ones(3), [(4, 4, 4)]) is None


def test_a_narrow_passage_and_another_grey_value_part_two_organs():
    grid = Grid((80, 50, 50), [1.5, 1.5, 1.5], [-60.0, -37.0, -37.0])
    liver = mask_of(ellipsoid((-22.0, 0.0, 0.0), (30.0, 30.0, 30.0)), grid)
    lobe = mask_of(ellipsoid((-22.0, 0.0, 26.0), (22.0, 18.0, 10.0)), grid)
    heart = mask_of(ellipsoid((33.0, 0.0, 0.0), (27.0, 27.0, 27.0)), grid)
    smooth = np.where(heart, 116.0, np.where(liver | lobe, 108.0, -90.0)).astype(np.float32)
    region = reachable_region(smooth, IntensityPrior(108.0, 4.0), grid.spacing_mm, [(25, 25, 25)])
    assert (region & (liver | lobe)).sum() > 0.95 * (liver | lobe).sum()
    assert (region & heart).sum() < 0.03 * heart.sum()


def test_a_dark_body_in_the_surface_is_a_tumour_and_a_neighbour_is_not():
    grid = Grid((70, 60, 60), [1.5, 1.5, 1.5], [-52.0, -44.0, -44.0])
    liver = mask_of(ellipsoid((0.0, 0.0, 0.0), (40.0, 34.0, 34.0)), grid)
    tumour = mask_of(ellipsoid((-32.0, 0.0, 0.0), (14.0, 14.0, 14.0)), grid) & liver
    neighbour = mask_of(ellipsoid((50.0, 0.0, 0.0), (14.0, 14.0, 14.0)), grid) & ~liver
    smooth = np.select([tumour, neighbour, liver], [60.0, 55.0, 108.0], -90.0).astype(np.float32)
    found = surface_tumours(liver & ~tumour, smooth, IntensityPrior(108.0, 4.0), grid.spacing_mm)
    assert (found & tumour).sum() > 0.9 * tumour.sum()
    assert not (found & neighbour).any()


def test_working_grid_goes_there_and_back():
    grid = Grid((61, 40, 97), [1.6, 3.0, 0.8], [5.0, 6.0, 7.0])
    working = WorkingGrid.of(grid, 1.6)
    assert working.factors == (1, 1, 2)
    ball = mask_of(ellipsoid((50.0, 60.0, 45.0), (30.0, 40.0, 25.0)), grid)
    small = working.working(ball) >= 0.5
    assert small.shape == (61, 40, 49)
    assert dice(working.full(small), ball) > 0.98
    assert working.working_index(np.array([10.2, 39.4, 96.0])) == (10, 39, 48)
    assert list(working.slices(48)) == [96]


def test_slices_that_look_wrong_are_flagged_with_reasons():
    grid = WorkingGrid((0, 1, 2), (1, 1, 2), (60, 60, 14), np.ones(3))
    disc = np.hypot(*np.meshgrid(np.arange(60) - 30.0, np.arange(60) - 30.0)) < 20.0
    mask = np.repeat(disc[:, :, None], 7, axis=2)
    mask[:, :, [0, 6]] = False
    smooth = np.where(mask, 110.0, -90.0).astype(np.float32)
    mask[30:, :, 2] = False
    smooth[:, :, 5] = 110.0
    area = float(disc.sum())
    contours = {k: SliceContour(area, area, 0.5, 0.0, True) for k in range(1, 6)}
    contours[1] = SliceContour(area, area, 0.5, 0.6, True)
    contours[3] = SliceContour(area, area, 0.01, 0.0, True)
    contours[4] = SliceContour(area, 2.0 * area, 0.5, 0.0, True)
    flags = {k: why.lower() for k, why in flag_slices(contours, mask, smooth, IntensityPrior(110.0, 4.0), grid)}
    assert "leak suspected: 60 %" in flags[2]
    assert "are absent that are there above and below" in flags[4]
    assert "stalled: the contour moved" in flags[6]
    assert "clean-up changed the area" in flags[8]
    assert "faint border" in flags[10]
    assert not {0, 12} & set(flags)
