import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.core.image import Grid
from glisson.framework.segmentation_scores import segmentation_scores

GRID = Grid((40, 40, 30), [1.0, 1.0, 2.0], [0.0, 0.0, 0.0])


def block(low: tuple[int, int, int], high: tuple[int, int, int]) -> np.ndarray:
    mask = np.zeros(GRID.shape, dtype=bool)
    mask[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = True
    return mask


def test_a_mask_agrees_with_itself() -> None:
    mask = block((5, 5, 5), (20, 20, 20))
    scores = segmentation_scores(mask, mask, GRID)
    assert (scores.dice, scores.asd_mm, scores.hd95_mm) == (1.0, 0.0, 0.0)


def test_a_shifted_block_has_the_overlap_that_one_can_count() -> None:
    # 10³ voxels shifted by 2 along i: 8/10 overlap.
    scores = segmentation_scores(block((5, 5, 5), (15, 15, 15)), block((7, 5, 5), (17, 15, 15)), GRID)
    assert scores.dice == pytest.approx(0.8)
    assert scores.hd95_mm == pytest.approx(2.0)


def test_distances_are_in_mm_along_every_axis() -> None:
    # A plane of voxels against one three slices away: 3 × 2 mm, on every voxel of both.
    scores = segmentation_scores(block((0, 0, 5), (40, 40, 6)), block((0, 0, 8), (40, 40, 9)), GRID)
    assert scores.dice == 0.0
    assert scores.asd_mm == pytest.approx(6.0)
    assert scores.hd95_mm == pytest.approx(6.0)


def test_two_spheres_of_the_same_centre_are_as_far_apart_as_their_radii() -> None:
    grid = Grid((80, 80, 80), [0.5] * 3, [0.0] * 3)
    radius = np.linalg.norm(np.moveaxis(np.indices(grid.shape), 0, -1) * 0.5 - 20.0, axis=-1)
    scores = segmentation_scores(radius < 12.0, radius < 15.0, grid)
    assert scores.asd_mm == pytest.approx(3.0, abs=0.25)
    assert scores.dice == pytest.approx(2 * 12**3 / (12**3 + 15**3), abs=0.005)


def test_an_empty_mask_is_refused() -> None:
    empty = np.zeros(GRID.shape, dtype=bool)
    with pytest.raises(BadInput, match="reference mask is empty"):
        segmentation_scores(block((5, 5, 5), (6, 6, 6)), empty, GRID)
    with pytest.raises(BadInput, match="has shape"):
        segmentation_scores(empty[:-1], empty, GRID)
