"""Territories against asking every voxel, and the resections of Table 1."""

import time

import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.core.image import Grid, LabelMap
from glisson.phantom.family import make_phantom
from glisson.preoperative.segments.resections import TABLE_1, adjoining_pairs, resection_volumes, resections
from glisson.preoperative.segments.territories import nearest_labels


@pytest.fixture(scope="module")
def phantom():
    return make_phantom(21, (2.0, 2.0, 2.5))


def _brute_force(mask, grid, points, labels):
    found = np.zeros(mask.shape, dtype=np.uint8)
    for cells in np.array_split(np.argwhere(mask), 200):
        places = grid.points_from_indices(cells)
        apart = np.linalg.norm(places[:, None] - points, axis=2)
        found[tuple(cells.T)] = labels[apart.argmin(axis=1)]
    return found


def test_territories_are_those_of_asking_every_voxel():
    random = np.random.default_rng(5)
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    grid = Grid((37, 45, 29), np.array([0.8, 1.1, 2.3]), np.array([-20.0, 14.0, 3.0]), turn)
    mask = random.uniform(size=grid.shape) < 0.4
    points = grid.points_from_indices(random.uniform(-5, 40, size=(300, 3)))
    labels = random.integers(1, 9, size=300)
    np.testing.assert_array_equal(nearest_labels(mask, grid, points, labels), _brute_force(mask, grid, points, labels))


def test_territories_of_a_liver_are_those_of_asking_every_voxel(phantom):
    """The issue asks for 99.5 %; where two points are as near, either is right."""
    mask = phantom.organ.mask("liver")
    tree = phantom.exact.trees[0]
    labels = 1 + np.arange(len(tree.points_mm)) * 8 // len(tree.points_mm)
    ours = nearest_labels(mask, phantom.organ.grid, tree.points_mm, labels)
    theirs = _brute_force(mask, phantom.organ.grid, tree.points_mm, labels)
    assert (ours == theirs)[mask].mean() >= 0.999
    assert not ours[~mask].any()


def test_territories_of_a_large_scan_take_seconds():
    """512 × 512 × 300 voxels and some thousand points in at most 5 s (the second call: the first one compiles)."""
    grid = Grid((512, 512, 300), np.array([0.7, 0.7, 1.0]), np.zeros(3))
    middle, radii = np.array([180.0, 180.0, 150.0]), np.array([100.0, 70.0, 75.0])
    axes = [spacing * np.arange(n) for n, spacing in zip(grid.shape, grid.spacing_mm, strict=True)]
    i, j, k = (((line - c) / r) ** 2 for line, c, r in zip(axes, middle, radii, strict=True))
    mask = i[:, None, None] + j[None, :, None] + k[None, None, :] < 1.0
    random = np.random.default_rng(1)
    points = middle + radii * random.normal(size=(5_000, 3)) / 3.0
    labels = random.integers(1, 9, size=5_000)
    nearest_labels(mask[:16, :16, :16] | True, Grid((16, 16, 16), grid.spacing_mm, middle), points, labels)
    started = time.perf_counter()
    found = nearest_labels(mask, grid, points, labels)
    assert time.perf_counter() - started <= 5.0
    assert (found > 0).sum() == mask.sum()


@pytest.mark.parametrize(
    ("points", "labels", "words"),
    [(np.zeros((0, 3)), [], "not 0 with 0 labels"), (np.zeros((2, 3)), [0, 1], "1 to 255, not 0 to 1")],
)
def test_territories_of_nothing_are_refused(points, labels, words):
    with pytest.raises(BadInput, match=words):
        nearest_labels(np.ones((2, 2, 2), dtype=bool), Grid((2, 2, 2), np.ones(3), np.zeros(3)), points, labels)


def test_table_1_is_the_dissertations():
    """R and E of its rows, segment 1 to 8."""
    printed = {
        "right liver resection": "E..ERRRR",
        "left liver resection": "ERRRE..E",
        "left lobectomy": ".RR.....",
    }
    for kind in TABLE_1:
        letters = dict.fromkeys(kind.removed, "R") | dict.fromkeys(kind.extendable, "E")
        assert "".join(letters.get(number, ".") for number in range(1, 9)) == printed[kind.name]
    assert [len(list(kind.variants())) for kind in TABLE_1] == [4, 8, 1]


def test_what_is_removed_and_what_remains_is_the_liver(phantom):
    found = {row.resection.name: row for row in resection_volumes(phantom.couinaud)}
    whole = float((phantom.couinaud.voxels > 0).sum()) * phantom.couinaud.grid.voxel_volume_mm3 * 1e-3
    for row in found.values():
        assert row.removed_ml + row.remnant_ml == pytest.approx(whole, rel=1e-9)
    assert sum(found[f"segment {number}"].removed_ml for number in range(1, 9)) == pytest.approx(whole, rel=1e-9)
    both = found["right liver resection extended to 1 and 4"]
    assert both.remnant_ml == pytest.approx(found["left lobectomy"].removed_ml)
    assert both.resection.is_major
    assert not found["left lobectomy"].resection.is_major
    assert not any(row.resection.is_major for row in found.values() if row.resection.name.startswith("segment"))
    assert 0.0 < both.remnant_share < found["left lobectomy"].remnant_share < 1.0


def test_pairs_are_those_that_adjoin():
    voxels = np.zeros((8, 3, 3), dtype=np.uint8)
    voxels[:] = np.arange(1, 9)[:, None, None]
    row = LabelMap(voxels, Grid((8, 3, 3), np.ones(3), np.zeros(3)), {n: f"segment {n}" for n in range(1, 9)})
    assert adjoining_pairs(row) == tuple((n, n + 1) for n in range(1, 8))
    names = [resection.name for resection in resections(row)]
    assert "segments 1 and 2" in names
    assert "segments 2 and 3" not in names  # it is the left lobectomy
    assert len(set(names)) == len(names)


def test_a_liver_without_one_of_its_segments_is_refused(phantom):
    voxels = phantom.couinaud.voxels.copy()
    voxels[voxels == 6] = 7
    with pytest.raises(BadInput, match="no voxel of segment 6"):
        resection_volumes(LabelMap(voxels, phantom.couinaud.grid, phantom.couinaud.names))
