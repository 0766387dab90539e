"""Structures marked by clicks: phantoms whose answers are known, and what is refused."""

import numpy as np
import pytest

from glisson.core.errors import BadInput, StageFailed
from glisson.core.image import Grid, LabelMap, Volume
from glisson.core.protocols import MarkedStructure
from glisson.phantom.appearance import draw_ct
from glisson.phantom.family import make_phantom
from glisson.preoperative.structures.contour import ContourStructure
from glisson.preoperative.structures.parameters import StructureParameters
from glisson.preoperative.structures.threshold import ThresholdStructure
from preoperative_shapes import dice
from small_case import GRID, TUMOUR_MM, images

MEMBERS = range(756, 764)
LIVER_BOX = Grid((104, 54, 70), [2.0, 2.0, 2.5], [-120.0, -84.0, -90.0])
"""Where the left lobe, the gallbladder and the wire of all members lie, and most of the right lobe."""


def mark(volume, organ, name, *points, technique=ThresholdStructure, **options) -> MarkedStructure:
    return technique(StructureParameters(**options)).mark(volume, organ, name, np.array(points))


def random_click(mask, grid, random):
    cells = np.argwhere(mask)
    return grid.points_from_indices(cells[random.integers(len(cells))][None])[0]


@pytest.fixture(scope="module")
def phantoms():
    return [make_phantom(seed, grid=LIVER_BOX, appearance=draw_ct(seed)) for seed in MEMBERS]


@pytest.mark.parametrize("technique", [ThresholdStructure, ContourStructure])
def test_tumours_of_phantoms_from_a_random_click(phantoms, technique, capfd):
    """The click may be any voxel of the tumour, so half of them lie at its border."""
    random, scores = np.random.default_rng(0), []
    for phantom in phantoms:
        for name in phantom.tumours.names.values():
            truth = phantom.tumours.mask(name)
            click = random_click(truth, LIVER_BOX, random)
            found = mark(phantom.volume, phantom.organ, name, click, technique=technique)
            scores.append(dice(found.labels.mask(name), truth))
    with capfd.disabled():
        print(
            f"\n{technique.name}, {len(scores)} tumours: Dice median {np.median(scores):.3f}, worst {min(scores):.3f}"
        )
    assert np.median(scores) >= 0.85
    assert min(scores) >= 0.7


def test_gallbladders_of_phantoms_from_a_click_well_inside(phantoms, capfd):
    scores = []
    for phantom in phantoms:
        truth = phantom.structures.mask("gallbladder")
        centre = LIVER_BOX.points_from_indices(np.argwhere(truth)).mean(axis=0)
        found = mark(phantom.volume, phantom.organ, "gallbladder", centre)
        scores.append(dice(found.labels.mask("gallbladder"), truth))
    with capfd.disabled():
        print(f"\n{len(scores)} gallbladders: Dice median {np.median(scores):.3f}, worst {min(scores):.3f}")
    assert min(scores) >= 0.85


def scene() -> tuple[Volume, LabelMap]:
    volume, groups = images()
    return volume, groups["organ"]


def test_a_tumour_with_a_narrow_bridge_does_not_leak():
    """A dark bridge of 3 mm leads from the tumour of 12 mm to a dark lake: only the tumour is marked."""
    volume, organ = scene()
    places = GRID.points_from_indices(np.moveaxis(np.indices(GRID.shape), 0, -1).reshape(-1, 3))
    away = places - TUMOUR_MM
    bridge = (np.abs(away[:, 1]) < 2.0) & (np.abs(away[:, 2]) < 2.0) & (np.abs(away[:, 0] + 15.0) < 15.0)
    lake = np.linalg.norm(away + [35.0, 0.0, 0.0], axis=1) < 10.0
    dark = (bridge | lake).reshape(GRID.shape) & (volume.voxels > 85)
    leaky = Volume(np.where(dark, 60, volume.voxels).astype(np.int16), GRID)
    truth = (np.linalg.norm(away, axis=1) < 12.0).reshape(GRID.shape)
    found = mark(leaky, organ, "tumour1", TUMOUR_MM, passage_mm=8.0)
    assert dice(found.labels.mask("tumour1"), truth) > 0.85


def wire_scan(gap: bool) -> tuple[Volume, np.ndarray]:
    volume, _ = images()
    voxels = np.array(volume.voxels)
    line = np.zeros(GRID.shape, dtype=bool)
    line[20:44, 18, 22] = True
    bright = line.copy()
    if gap:
        bright[30, 18, 22] = False
    voxels[bright] = 1500
    return Volume(voxels, GRID), line


@pytest.mark.parametrize("gap", [False, True])
@pytest.mark.parametrize("name", ["wire", "stent"])
def test_metal_is_followed_through_a_small_gap(gap, name):
    volume, line = wire_scan(gap)
    click = GRID.points_from_indices([[22, 18, 22]])[0]
    found = mark(volume, None, name, click, gap_mm=7.0).labels.mask(name)
    assert not (found & ~line).any()
    assert found.sum() == line.sum() - gap


@pytest.mark.parametrize(
    ("name", "point", "sentence"),
    [
        ("tumour1", (500.0, 0.0, 0.0), "outside the scan"),
        ("tumour1", (-90.0, -50.0, -60.0), "fat or air"),
        ("gallbladder", (-90.0, -50.0, -60.0), "fat or air"),
        ("spleen", (0.0, 0.0, 0.0), "tumour1, tumour2"),
        ("tumour0", (0.0, 0.0, 0.0), "tumour1, tumour2"),
    ],
)
def test_bad_clicks_and_names_are_refused(name, point, sentence):
    volume, organ = scene()
    with pytest.raises(BadInput, match=sentence):
        mark(volume, organ, name, point)


def test_no_click_is_refused():
    volume, organ = scene()
    with pytest.raises(BadInput, match="--seed-point"):
        ThresholdStructure(StructureParameters()).mark(volume, organ, "tumour1", np.zeros((0, 3)))


def test_a_tumour_outside_the_liver_is_refused():
    volume, organ = scene()
    far = LabelMap(np.where(np.arange(64)[:, None, None] < 20, organ.voxels, 0).astype(np.uint8), GRID, {1: "liver"})
    with pytest.raises(BadInput, match="outside the liver's mask"):
        mark(volume, far, "tumour1", TUMOUR_MM)


def test_healthy_liver_is_no_tumour():
    volume, organ = scene()
    with pytest.raises(StageFailed, match="Nothing stands out"):
        mark(volume, organ, "tumour1", (-30.0, 0.0, 0.0))


def test_without_metal_there_is_no_wire():
    volume, organ = scene()
    with pytest.raises(StageFailed, match="no metal"):
        mark(volume, organ, "wire", (-30.0, 0.0, 0.0))


def test_a_wire_needs_a_ct_and_no_contour():
    volume, _ = wire_scan(False)
    click = GRID.points_from_indices([[22, 18, 22]])[0]
    with pytest.raises(BadInput, match="use a CT"):
        mark(Volume(volume.voxels, GRID, "MR"), None, "wire", click)
    with pytest.raises(BadInput, match="too thin"):
        mark(volume, None, "wire", click, technique=ContourStructure)


def test_a_gallbladder_that_the_scan_cuts_off_is_refused():
    volume, _ = scene()
    voxels = np.array(volume.voxels)
    voxels[50:, 12:24, 16:28] = 10
    with pytest.raises(StageFailed, match="scan's border"):
        mark(Volume(voxels, GRID), None, "gallbladder", GRID.points_from_indices([[57, 18, 22]])[0])


def test_doubts_are_told():
    volume, organ = scene()
    assert mark(volume, organ, "tumour1", TUMOUR_MM).notes == ()
    assert any("no liver mask" in note for note in mark(volume, None, "tumour1", TUMOUR_MM).notes)
    notes = mark(volume, organ, "gallbladder", TUMOUR_MM).notes
    assert any("HU; fluid usually has" in note for note in notes)
    assert any("liver's mask" in note for note in notes)
