from pathlib import Path

import numpy as np
import pytest

from dicom_samples import stored_values, write_series
from glisson.core.errors import BadInput
from glisson.core.image import Grid, LabelMap
from glisson.framework.case import ORGAN, SCAN, STRUCTURES, TUMOURS
from glisson.framework.comparing import compare_with_reference, given_mask_facts
from glisson.framework.importing import import_case
from glisson.io.images import read_labels, read_volume, write_labels, write_volume
from small_case import GRID, images

VOLUME, GROUPS = images()


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A scan and one file for each structure, as other tools write them."""
    write_volume(tmp_path / "scan.nrrd", VOLUME)
    folder = tmp_path / "masks"
    folder.mkdir()
    for name, group, label in (
        ("liver", "organ", "liver"),
        ("liver_lesion_2", "tumours", "tumour1"),
        ("bile_duct", "structures", "duct"),
    ):
        mask = GROUPS[group].mask(label).astype(np.uint8)
        write_labels(folder / f"{name}.nii.gz", LabelMap(mask, GRID, {1: name}))
    return tmp_path


def test_a_scan_and_a_folder_of_masks_become_a_case(files: Path) -> None:
    made = import_case(files / "case", files / "scan.nrrd", [files / "masks"])
    assert sorted(made.labels) == ["duct", "liver", "tumour2"]
    scan = read_volume(made.case.path(SCAN))
    assert np.array_equal(scan.voxels, VOLUME.voxels)
    assert scan.grid.matches(GRID)
    assert np.array_equal(read_labels(made.case.path(ORGAN)).mask("liver"), GROUPS["organ"].mask("liver"))
    assert read_labels(made.case.path(TUMOURS)).names == {1: "tumour2"}
    assert read_labels(made.case.path(STRUCTURES)).names == {1: "duct"}
    assert made.case.settings().choices["segment"].technique == "labels"


def test_without_the_liver_it_is_to_be_segmented(files: Path) -> None:
    made = import_case(files / "case", files / "scan.nrrd", [files / "masks" / "liver_lesion_2.nii.gz"])
    assert made.labels == ("tumour2",)
    assert not made.case.has(ORGAN)
    assert made.case.settings().choices["segment"].technique == "seeded-contour"


def test_a_dicom_folder_leaves_the_patient_behind(tmp_path: Path) -> None:
    write_series(
        tmp_path / "series", stored_values(), PatientName="Doe^Jane", PatientID="4711", InstitutionName="St. Elsewhere"
    )
    made = import_case(tmp_path / "case", tmp_path / "series")
    assert made.case.has(SCAN)
    raw = b"".join(path.read_bytes() for path in made.case.folder.rglob("*") if path.is_file())
    import gzip

    raw += gzip.decompress(made.case.path(SCAN).read_bytes())
    assert not any(word in raw for word in (b"Doe", b"Jane", b"4711", b"Elsewhere"))


def test_labels_of_unknown_names_are_left_out_since_names_may_be_patients(files: Path) -> None:
    voxels = GROUPS["organ"].voxels + 2 * GROUPS["tumours"].voxels
    both = LabelMap(voxels.astype(np.uint8), GRID, {1: "liver", 3: "Jane Doe"})
    write_labels(files / "both.nii.gz", both)
    made = import_case(files / "case", files / "scan.nrrd", [files / "both.nii.gz"])
    assert made.labels == ("liver",)
    assert made.left_out == 1
    write_labels(files / "doe.nii.gz", LabelMap(GROUPS["organ"].voxels, GRID, {1: "Jane Doe"}))
    with pytest.raises(BadInput, match="no label of a name that Glisson knows"):
        import_case(files / "other", files / "scan.nrrd", [files / "doe.nii.gz"])
    assert not (files / "other").exists()


def test_a_label_map_on_another_grid_is_refused_and_nothing_is_made(files: Path) -> None:
    grid = Grid(GRID.shape, GRID.spacing_mm, GRID.origin_mm + 5.0)
    write_labels(files / "liver.nii.gz", LabelMap(GROUPS["organ"].voxels, grid, {1: "liver"}))
    with pytest.raises(BadInput, match="another grid than the scan"):
        import_case(files / "case", files / "scan.nrrd", [files / "liver.nii.gz"])
    assert not (files / "case").exists()


def test_a_reference_is_a_mask_of_any_origin(files: Path) -> None:
    case = import_case(files / "case", files / "scan.nrrd", [files / "masks"]).case
    assert given_mask_facts(case)["volume_ml"] == pytest.approx(4 / 3 * np.pi * 75 * 36 * 48 * 1e-3, rel=0.01)
    assert compare_with_reference(case, files / "masks" / "liver.nii.gz").dice == 1.0
    assert compare_with_reference(case, files / "masks").dice == 1.0
    # A file with one label of any name is taken for the liver.
    smaller = GROUPS["organ"].mask("liver").copy()
    smaller[:32] = False
    write_labels(files / "half.nii.gz", LabelMap(smaller.astype(np.uint8), GRID, {1: "half"}))
    part, whole = int(smaller.sum()), int(GROUPS["organ"].mask("liver").sum())
    assert compare_with_reference(case, files / "half.nii.gz").dice == pytest.approx(2 * part / (part + whole))
    voxels = smaller.astype(np.uint8) + GROUPS["organ"].voxels
    write_labels(files / "two.nii.gz", LabelMap(voxels, GRID, {1: "spleen", 2: "stomach"}))
    with pytest.raises(BadInput, match="no label 'liver'"):
        compare_with_reference(case, files / "two.nii.gz")


def test_text_that_is_drawn_into_the_pixels_is_told(tmp_path: Path) -> None:
    """By the header, or by pixels that are the same in all slices; the padding about a field of view is no text."""
    values = 900 + stored_values() // 16  # -124 to 131 HU, and air
    values[:, :4, :] = 0
    write_series(tmp_path / "plain", values)
    assert import_case(tmp_path / "a", tmp_path / "plain").warnings == ()
    write_series(tmp_path / "said", values, BurnedInAnnotation="YES")
    assert "headers say" in str(import_case(tmp_path / "b", tmp_path / "said").warnings)
    values[:, 20:24, 10:20] = 4000
    write_series(tmp_path / "seen", values)
    assert "40 pixels are the same in all slices" in str(import_case(tmp_path / "c", tmp_path / "seen").warnings)
