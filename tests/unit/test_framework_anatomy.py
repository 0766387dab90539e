"""The vessels stage in a case: from the scan, from given labels, and refused."""

import json
from dataclasses import replace

import numpy as np
import pytest

from glisson.core import BadInput, Grid, LabelMap, Volume
from glisson.core.structures import VesselTree
from glisson.framework.case import VESSEL_TREES, VESSELS, new_case, open_case
from glisson.framework.importing import write_images
from glisson.framework.settings import Settings, VesselSettings
from glisson.framework.stages import PIPELINE
from glisson.io.images import read_labels, write_labels
from glisson.io.vessel_files import read_vessels, write_vessels
from glisson.phantom.canvas import Canvas, voxel_places

GRID = Grid((84, 60, 56), [1.0, 1.0, 1.0], [-40.0, -30.0, -28.0])
CLICKS = VesselSettings(((-28.0, 8.0, -8.0),), ((2.0, -20.0, 20.0),))
PORTAL = VesselTree(
    "portal", [[-30, 8, -8], [32, 8, -8], [8, 8, -8], [20, 20, 12]], [3.5, 2.5, 2.2, 2.0], [[0, 1], [2, 3]]
)
HEPATIC = VesselTree("hepatic", [[2, -22, 22], [2, 8, -8], [2, 20, -20]], [3.5, 2.8, 2.2], [[0, 1], [1, 2]])


def mask_of(tree):
    canvas = Canvas(GRID, np.zeros(GRID.shape, dtype=np.float32), voxel_places(GRID), 0.0)
    return canvas.paint_tree(tree, 1.0)


def make_case(folder, contrast_hu=65.0, with_structures=False):
    points = GRID.points_from_indices(np.moveaxis(np.indices(GRID.shape), 0, -1).reshape(-1, 3)).reshape(*GRID.shape, 3)
    liver = (np.abs(points - [2, 0, 0]) < [36, 26, 25]).all(axis=-1)
    portal, hepatic = mask_of(PORTAL) & liver, mask_of(HEPATIC) & liver
    voxels = np.where(liver, 100.0, -80.0) + contrast_hu * (portal | hepatic)
    voxels += np.random.default_rng(5).normal(0.0, 10.0, GRID.shape)
    groups = {"organ": LabelMap(liver.astype(np.uint8), GRID, {1: "liver"})}
    if with_structures:
        labels = np.where(portal, 1, 2 * hepatic).astype(np.uint8)
        groups["structures"] = LabelMap(labels, GRID, {1: "portal", 2: "hepatic"})
    settings = replace(Settings().choosing("segment", "labels", {}), vessels=CLICKS)
    with new_case(folder, settings) as making:
        write_images(making, Volume(voxels.astype(np.int16), GRID), groups)
    return open_case(folder), portal, hepatic


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    case, portal, hepatic = make_case(tmp_path_factory.mktemp("vessels") / "case")
    return case, portal, hepatic, PIPELINE.run(case, "vessels")


def test_vessels_are_found_and_told_apart(found):
    case, portal, hepatic, result = found
    assert set(result.seconds) == {"segment", "vessels"}
    facts = result.facts["vessels"]
    assert facts["source"] == "tubeness"
    assert all("touch" in note for note in facts["notes"])
    labels = read_labels(case.path(VESSELS))
    for name, mask, other in (("portal", portal, hepatic), ("hepatic", hepatic, portal)):
        assert (labels.mask(name) & mask & ~other).sum() > 0.8 * (mask & ~other).sum()
        assert (labels.mask(name) & other & ~mask).sum() < 0.1 * other.sum()
    trees = read_vessels(case.path(VESSEL_TREES))
    assert {"portal", "hepatic"} <= {tree.name for tree in trees}
    assert facts["length_mm"] == pytest.approx({tree.name: tree.length_mm for tree in trees})


def test_what_did_not_change_is_kept(found):
    case, *_ = found
    assert PIPELINE.run(case, "vessels").seconds["vessels"] == 0.0
    moved = replace(case.settings(), vessels=VesselSettings(((-26.0, 8.0, -8.0),), CLICKS.hepatic_mm))
    assert PIPELINE.run(case, "vessels", moved).seconds["vessels"] > 0.0
    assert case.settings().vessels.portal_mm == ((-26.0, 8.0, -8.0),)


def test_the_command(found, glisson, tmp_path):
    case, portal, hepatic, _ = found
    reference = LabelMap(np.where(portal, 1, 2 * hepatic).astype(np.uint8), GRID, {1: "portal", 2: "hepatic"})
    write_labels(tmp_path / "veins.nii.gz", reference)
    code, said = glisson(
        "vessels",
        case.folder,
        "--portal",
        "-28,8,-8",
        "--hepatic",
        "2,-20,20",
        "--reference",
        tmp_path / "veins.nii.gz",
    )
    assert code == 0
    assert said["dice"] > 0.75
    assert said["centreline_dice"] > 0.85
    assert said["right_system"] > 0.9


def test_given_veins_are_taken(tmp_path):
    case, portal, hepatic = make_case(tmp_path / "case", with_structures=True)
    facts = PIPELINE.run(case, "vessels").facts["vessels"]
    assert facts["source"] == "labels/structures.nii.gz"
    assert (read_labels(case.path(VESSELS)).mask("hepatic") == (hepatic & ~portal)).all()
    lengths = facts["length_mm"]
    assert lengths["portal"] == pytest.approx(60.0 + 26.0, abs=12.0)


@pytest.mark.parametrize("contrast_hu", [0.0, -12.0])
def test_a_scan_without_contrast_is_refused(tmp_path, contrast_hu):
    case, *_ = make_case(tmp_path / "case", contrast_hu)
    with pytest.raises(BadInput, match="do not stand out"):
        PIPELINE.run(case, "vessels")
    assert not case.has(VESSELS)
    assert not case.has(VESSEL_TREES)


def test_a_damaged_file_of_trees_is_refused(tmp_path):
    write_vessels(tmp_path / "vessels.json", [PORTAL])
    assert np.array_equal(read_vessels(tmp_path / "vessels.json")[0].edges, PORTAL.edges)
    values = json.loads((tmp_path / "vessels.json").read_text())
    values["trees"][0]["edges"][0] = [0, 99]
    (tmp_path / "vessels.json").write_text(json.dumps(values))
    with pytest.raises(BadInput, match="vessel edge"):
        read_vessels(tmp_path / "vessels.json")
