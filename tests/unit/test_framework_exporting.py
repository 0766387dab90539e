"""A case's labels leave for other programs and come back as they were, through the command as a user runs it."""

import json

import numpy as np
import pytest
from pydicom.uid import generate_uid

from dicom_samples import write_series
from glisson.cli.main import main
from glisson.core import LabelMap
from glisson.framework.importing import import_case
from glisson.io.dicom import read_dicom_folder
from glisson.io.images import read_label_maps, write_labels


@pytest.fixture
def case(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 4096, (12, 40, 36)).astype(np.uint16)
    write_series(tmp_path / "scan", pixels, StudyInstanceUID=generate_uid(), FrameOfReferenceUID=generate_uid())
    grid = read_dicom_folder(tmp_path / "scan").grid
    organ, tumour = np.zeros(grid.shape, np.uint8), np.zeros(grid.shape, np.uint8)
    organ[4:20, 5:25, 3:9] = 1
    tumour[8:12, 9:13, 5:7] = 1
    (tmp_path / "masks").mkdir()
    write_labels(tmp_path / "masks" / "liver.nii.gz", LabelMap(organ, grid, {1: "liver"}))
    write_labels(tmp_path / "masks" / "tumour1.nii.gz", LabelMap(tumour, grid, {1: "tumour1"}))
    return import_case(tmp_path / "case", tmp_path / "scan", [tmp_path / "masks"]).case


@pytest.mark.parametrize("name", ["out.seg.nrrd", "out.dcm"])
def test_labels_go_out_and_come_back(tmp_path, case, name, capfd):
    scan = tmp_path / "scan"
    assert main(["export", str(case.folder), str(tmp_path / name), "--scan", str(scan), "--json"]) == 0
    assert json.loads(capfd.readouterr().out)["labels"] == ["liver", "tumour1"]
    back = import_case(tmp_path / "back", scan, [tmp_path / name])
    assert set(back.labels) == {"liver", "tumour1"}
    for part in ("labels/organ.nii.gz", "labels/tumours.nii.gz"):
        (before,), (after,) = read_label_maps(case.path(part)), read_label_maps(back.case.path(part))
        assert np.array_equal(before.voxels, after.voxels)
        assert dict(before.names) == dict(after.names)


def test_what_cannot_be_exported_is_a_sentence(tmp_path, case, capfd):
    assert main(["export", str(case.folder), str(tmp_path / "out.dcm")]) == 2
    assert "give their DICOM folder" in capfd.readouterr().err
    case.path("labels/organ.nii.gz").unlink()
    assert main(["export", str(case.folder), str(tmp_path / "out.seg.nrrd")]) == 2
    assert "glisson segment" in capfd.readouterr().err
    assert not list(tmp_path.glob("out.*"))
