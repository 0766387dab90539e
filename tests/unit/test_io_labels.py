import numpy as np
import pytest

from glisson.core import BadInput, Grid, LabelMap, Volume
from glisson.io.images import read_label_maps, read_labels, write_labels, write_volume
from glisson.io.label_groups import group_labels, on_grid_of, require_same_grid
from glisson.io.label_names import canonical_name, canonical_names
from glisson.io.totalsegmentator import class_names

GRID = Grid((8, 7, 6), [1.0, 1.5, 2.0], [10.0, 20.0, 30.0])


def box(low, high, name, grid=GRID):
    voxels = np.zeros(grid.shape, np.uint8)
    voxels[tuple(slice(a, b) for a, b in zip(low, high, strict=True))] = 1
    return LabelMap(voxels, grid, {1: name})


@pytest.mark.parametrize(
    ("other", "ours"),
    [
        ("Liver", "liver"),
        ("livertumor", "tumour1"),
        ("livertumor02", "tumour2"),
        ("livertumors", "tumour1"),
        ("liver_tumor", "tumour1"),
        ("Tumour 3", "tumour3"),
        ("hepatic lesion 4", "tumour4"),
        ("portalvein", "portal"),
        ("portal_vein_and_splenic_vein", "portal"),
        ("venoussystem", "hepatic"),
        ("inferior_vena_cava", "ivc"),
        ("venacava", "ivc"),
        ("gall-bladder", "gallbladder"),
        ("spleen", "spleen"),
        ("leftsurretumor", "leftsurretumor"),  # a tumour of the adrenal gland is none of the liver
        ("kidney_left", "kidney_left"),
    ],
)
def test_names_of_other_tools(other, ours):
    assert canonical_name(other) == ours
    assert canonical_name(canonical_name(other)) == ours


def test_two_claimants_of_a_name_stay_apart():
    assert canonical_names(["portalvein", "portal_vein", "livertumor", "livertumor1", "livertumor2"]) == [
        "portal",
        "portal_vein",
        "tumour1",
        "tumour2",
        "tumour3",
    ]


def test_class_table_of_totalsegmentator():
    names = class_names()
    assert sorted(names) == list(range(1, 118))
    assert len(set(names.values())) == 117
    # Anchors from the published table of version 2.
    anchors = {1: "spleen", 5: "liver", 51: "heart", 52: "aorta", 90: "brain", 117: "costal_cartilages"}
    assert anchors.items() <= names.items()
    assert names[63] == "inferior_vena_cava"
    assert names[64] == "portal_vein_and_splenic_vein"


def numbered(path, values):
    voxels = np.zeros(GRID.shape, np.uint8)
    voxels.flat[: len(values)] = values
    write_volume(path, Volume(voxels, GRID))
    return path


def test_scheme_by_number(tmp_path):
    labels = read_labels(numbered(tmp_path / "seg.nii.gz", [5, 5, 63, 64, 1]), "totalsegmentator")
    assert dict(labels.names) == {1: "spleen", 5: "liver", 63: "ivc", 64: "portal"}
    assert labels.volume_ml("liver") == pytest.approx(2 * 3.0e-3)


def test_mask_is_named_by_mapping_or_file(tmp_path):
    path = numbered(tmp_path / "livertumor02.nii.gz", [255, 255])
    assert dict(read_labels(path).names) == {255: "tumour2"}
    assert dict(read_labels(path, names={255: "liver"}).names) == {255: "liver"}


def test_unnamed_numbers_are_refused(tmp_path):
    path = numbered(tmp_path / "seg.nrrd", [1, 2, 118])
    with pytest.raises(BadInput, match="labels 1, 2, 118 have no name; give the names, or the scheme"):
        read_labels(path)
    with pytest.raises(BadInput, match="labels 118 have no name"):
        read_labels(path, "totalsegmentator")
    with pytest.raises(BadInput, match="Unknown label scheme 'synapse'"):
        read_labels(path, "synapse")


def test_groups_of_overlapping_masks():
    liver, tumour = box((1, 1, 1), (6, 6, 5), "liver"), box((5, 2, 2), (7, 4, 4), "tumour1")
    second = box((1, 1, 1), (2, 2, 2), "tumour10")
    portal, skin = box((2, 2, 2), (4, 3, 3), "portal"), box((0, 0, 0), (8, 7, 6), "skin")
    groups = group_labels([skin, second, portal, tumour, liver])
    assert dict(groups["organ"].names) == {1: "liver"}
    # The tumour reaches beyond the given liver mask; the whole organ includes it.
    assert np.array_equal(groups["organ"].mask("liver"), (liver.voxels | tumour.voxels | second.voxels) == 1)
    assert dict(groups["tumours"].names) == {1: "tumour1", 2: "tumour10"}
    assert np.array_equal(groups["tumours"].mask("tumour1"), tumour.voxels == 1)
    assert set(groups["structures"].names.values()) == {"portal", "skin"}
    assert np.array_equal(groups["structures"].mask("portal"), portal.voxels == 1)  # the smaller one wins


def test_groups_leave_out_what_is_empty_and_unite_the_same_name():
    empty = LabelMap(np.zeros(GRID.shape, np.uint8), GRID, {1: "tumour1"})
    halves = [box((0, 0, 0), (4, 7, 6), "liver"), box((4, 0, 0), (8, 7, 6), "liver"), empty]
    groups = group_labels(halves)
    assert list(groups) == ["organ"]
    assert groups["organ"].voxels.all()
    assert group_labels([]) == {}


def test_another_grid_is_described():
    other = Grid((8, 7, 5), [1.0, 1.5, 2.5], [10.0, 20.0, 30.0])
    with pytest.raises(BadInput) as caught:
        require_same_grid(GRID, box((0, 0, 0), (1, 1, 1), "liver", other), "the label map liver.nii.gz")
    sentence = str(caught.value)
    assert sentence.startswith("The label map liver.nii.gz lies on another grid than the scan")
    assert "8 × 7 × 5 voxels of 1 × 1.5 × 2.5 mm" in sentence
    assert "8 × 7 × 6 voxels of 1 × 1.5 × 2 mm from (10.00, 20.00, 30.00)" in sentence
    with pytest.raises(BadInput, match="another grid"):
        group_labels([box((0, 0, 0), (1, 1, 1), "liver"), box((0, 0, 0), (1, 1, 1), "portal", other)])


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 0, 2)])
@pytest.mark.parametrize("flips", [(), (1,), (0, 2), (0, 1, 2)])
def test_flipped_axes_are_turned_back(order, flips):
    rotation, _ = np.linalg.qr(np.random.default_rng(4).normal(size=(3, 3)))
    grid = Grid((8, 7, 6), [1.0, 1.5, 2.0], [10.0, 20.0, 30.0], rotation)
    voxels = np.random.default_rng(5).integers(0, 3, grid.shape).astype(np.uint8)
    # The same image stored differently: where voxel (i, j, k) went is asked of the affine alone.
    stored = np.flip(voxels.transpose(order), flips)
    corner = np.zeros(3)
    signs = np.ones(3)
    for axis in flips:
        corner[order[axis]] = grid.shape[order[axis]] - 1
        signs[axis] = -1.0
    turned = Grid(
        stored.shape, grid.spacing_mm[list(order)], grid.points_from_indices(corner), rotation[:, order] * signs
    )
    labels = LabelMap(np.ascontiguousarray(stored), turned, {1: "liver", 2: "portal"})
    back = on_grid_of(grid, labels, "the label map")
    assert back.grid.matches(grid)
    assert np.array_equal(back.voxels, voxels)
    shifted = Grid(turned.shape, turned.spacing_mm, turned.origin_mm + 0.5, turned.direction)
    with pytest.raises(BadInput, match="another grid"):
        on_grid_of(grid, LabelMap(labels.voxels, shifted, labels.names), "the label map")


def test_written_groups_read_back(tmp_path):
    groups = group_labels([box((1, 1, 1), (6, 6, 5), "liver"), box((2, 2, 2), (4, 3, 3), "duct")])
    for name, labels in groups.items():
        write_labels(tmp_path / f"{name}.nii.gz", labels)
        assert dict(read_labels(tmp_path / f"{name}.nii.gz").names) == dict(labels.names)


def test_a_folder_of_mask_files_is_one_map_each(tmp_path):
    for name in ("liver", "inferior_vena_cava", "kidney_left"):
        numbered(tmp_path / f"{name}.nii.gz", [1])
    (tmp_path / ".hidden").write_text("")
    (tmp_path / "readme.txt").write_text("")
    maps = read_label_maps(tmp_path)
    assert [dict(labels.names) for labels in maps] == [{1: "ivc"}, {1: "kidney_left"}, {1: "liver"}]
