"""De-identified copies, judged by their bytes, by pydicom and by SimpleITK."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
import SimpleITK as sitk
from pydicom.datadict import dictionary_has_tag, dictionary_VR, keyword_for_tag
from pydicom.dataelem import DataElement
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import JPEG2000Lossless, generate_uid

from dicom_samples import recompress, slice_dataset, stored_values, write_series
from glisson.core import BadInput, LabelMap
from glisson.io import deidentification
from glisson.io.confidentiality_profile import profile_actions, replaced_uid
from glisson.io.deidentification import deidentify_folder
from glisson.io.dicom import series_slices
from glisson.io.images import read_label_maps, read_volume, write_segments

SECRET = "SECRET"
DATE, TIME = "20010911", "084640"
SECRET_VALUES = {
    "AS": "077Y", "DA": DATE, "TM": TIME, "DT": DATE + TIME, "DS": "77.77", "IS": "7777", "US": 7777, "FD": 77.77,
    "UR": "http://secret.example", "OB": b"SECRET", "OW": b"SECRET", "UN": b"SECRET",
}  # fmt: skip
ORIGINAL_UID = "1.2.3.77"


def secret(tag: int) -> DataElement:
    """An element with a value that must not be seen again; sequences hold one of their own."""
    vr = dictionary_VR(tag).split(" or ")[0]
    if vr == "SQ":
        inner = Dataset()
        inner.PatientName, inner.ReferencedSOPInstanceUID = SECRET, f"{ORIGINAL_UID}.9"
        return DataElement(tag, vr, Sequence([inner]))
    return DataElement(tag, vr, f"{ORIGINAL_UID}.{tag}" if vr == "UI" else SECRET_VALUES.get(vr, SECRET))


def stuff(dataset: Dataset) -> None:
    """Every attribute of the table, private ones, an overlay, an unknown one, and the same again within a sequence."""
    for tag in profile_actions():
        if dictionary_has_tag(tag) and tag >> 16 not in (0x0000, 0x0002, 0x0004) and tag not in dataset:
            dataset[tag] = secret(tag)
    block = dataset.private_block(0x0029, "SECRET MAKER", create=True)
    block.add_new(0x01, "LO", SECRET)
    dataset.add_new(0x60003000, "OW", b"SECRET")
    dataset.add_new(0x60004000, "LT", SECRET)
    dataset.add_new(0x00105555, "LO", SECRET)


@pytest.fixture
def stuffed(tmp_path: Path) -> Path:
    folder = tmp_path / "DOE^JOHN"
    for path in write_series(folder, stored_values(3), FrameOfReferenceUID=generate_uid(), StudyInstanceUID="1.2.3.4"):
        dataset = pydicom.dcmread(path)
        stuff(dataset)
        inner = Dataset()
        stuff(inner)
        dataset.RealWorldValueMappingSequence = Sequence([inner])  # none of the table's
        dataset.preamble = b"SECRET".ljust(128, b"\0")
        dataset.file_meta.SourceApplicationEntityTitle = SECRET
        dataset.save_as(path)
    return folder


def copies(folder: Path) -> list[Dataset]:
    return [pydicom.dcmread(path) for path in sorted(folder.iterdir())]


def test_nothing_that_identifies_is_left_in_the_bytes(stuffed: Path, tmp_path: Path) -> None:
    made = deidentify_folder(stuffed, tmp_path / "out")
    assert (made.folders, made.files, made.left_out) == ((tmp_path / "out",), 3, 0)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["00001.dcm", "00002.dcm", "00003.dcm"]
    for path in (tmp_path / "out").iterdir():
        content = path.read_bytes()
        for mark in (SECRET, DATE, TIME, "77.77", "7777", "077Y", ORIGINAL_UID, "1.2.3.4", "secret.example"):
            assert mark.encode() not in content


def test_each_attribute_of_the_table_is_dealt_with_as_it_says(stuffed: Path, tmp_path: Path) -> None:
    deidentify_folder(stuffed, tmp_path / "out")
    [before, *_] = copies(stuffed)
    after = next(d for d in copies(tmp_path / "out") if d.ImagePositionPatient == before.ImagePositionPatient)
    pairs = [(before, after), (before.RealWorldValueMappingSequence[0], after.RealWorldValueMappingSequence[0])]
    dealt = 0
    for old, new in pairs:
        for tag, action in profile_actions().items():
            if tag not in old:
                continue
            dealt += 1
            name, element = keyword_for_tag(tag), new.get(tag)
            if action == "X":
                assert element is None, name
            elif action in ("Z", "X/Z"):
                assert element.is_empty, name
            elif action == "U":
                assert element.value == replaced_uid(old[tag].value) != old[tag].value, name
            elif "D" in action:
                assert not element.is_empty, name
                assert element.value != old[tag].value, name
        assert not any(element.tag.is_private or element.tag.group == 0x6000 for element in new)
    assert dealt > 1000


@pytest.mark.parametrize(
    ("keyword", "action"),
    [
        # As printed in PS3.15, Table E.1-1.
        *((name, "Z") for name in ("AccessionNumber", "PatientName", "PatientBirthDate", "PatientSex", "StudyDate")),
        *((name, "Z") for name in ("StudyTime", "StudyID", "ReferringPhysicianName", "ConsultingPhysicianName")),
        *((name, "X") for name in ("PatientAddress", "PatientAge", "PatientWeight", "OtherPatientIDs")),
        *((name, "X") for name in ("StudyDescription", "SeriesDescription", "InstitutionAddress")),
        *((name, "X") for name in ("AdditionalPatientHistory", "DerivationDescription", "IconImageSequence")),
        *((name, "U") for name in ("StudyInstanceUID", "SeriesInstanceUID", "SOPInstanceUID", "FrameOfReferenceUID")),
        *((name, "U") for name in ("ReferencedSOPInstanceUID", "DimensionOrganizationUID", "DeviceUID")),
        *((name, "Z/D") for name in ("ContentDate", "ContentTime", "ContentCreatorName", "ContrastBolusAgent")),
        *((name, "X/Z") for name in ("AcquisitionContextSequence", "AcquisitionDate", "AcquisitionTime")),
        *((name, "X/D") for name in ("DetectorID", "AcquisitionDeviceProcessingDescription")),
        *((name, "X/Z/D") for name in ("AcquisitionDateTime", "DeviceSerialNumber")),
        *((name, "D") for name in ("ContentSequence", "ClinicalTrialSubjectID", "AcquisitionFieldOfViewLabel")),
    ],
)  # fmt: skip
def test_the_table_is_that_of_the_standard(keyword: str, action: str) -> None:
    assert profile_actions()[pydicom.datadict.tag_for_keyword(keyword) or 0] == action


def test_it_is_said_that_the_identity_was_removed(stuffed: Path, tmp_path: Path) -> None:
    deidentify_folder(stuffed, tmp_path / "out")
    for copy in copies(tmp_path / "out"):
        assert copy.PatientIdentityRemoved == "YES"
        assert copy.LongitudinalTemporalInformationModified == "REMOVED"
        assert len(copy.DeidentificationMethod) <= 64
        [code] = copy.DeidentificationMethodCodeSequence
        assert (code.CodeValue, code.CodingSchemeDesignator) == ("113100", "DCM")
        assert copy.file_meta.MediaStorageSOPInstanceUID == copy.SOPInstanceUID


@pytest.mark.parametrize("syntax", [None, JPEG2000Lossless])
def test_pixels_and_geometry_are_what_they_were(tmp_path: Path, syntax: str | None) -> None:
    """Bit for bit by pydicom, and as SimpleITK reads both series."""
    paths = write_series(tmp_path / "in", stored_values(4), step=2.4999999, RescaleSlope="1.000000")
    for path in paths if syntax else []:
        recompress(path, syntax)
    deidentify_folder(tmp_path / "in", tmp_path / "out")
    geometry = ("ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "RescaleSlope", "RescaleIntercept")
    old, new = copies(tmp_path / "in"), {str(d.ImagePositionPatient): d for d in copies(tmp_path / "out")}
    for before in old:
        after = new[str(before.ImagePositionPatient)]
        assert after.PixelData == before.PixelData
        for keyword in geometry:
            raw = before.get_item(pydicom.datadict.tag_for_keyword(keyword) or 0)
            assert after.get_item(raw.tag).value == raw.value, keyword
    images = [read_by_simpleitk(tmp_path / name) for name in ("in", "out")]
    assert np.array_equal(*(sitk.GetArrayFromImage(image) for image in images))
    assert images[0].GetOrigin() == images[1].GetOrigin()
    assert images[0].GetSpacing() == images[1].GetSpacing()
    assert images[0].GetDirection() == images[1].GetDirection()


def read_by_simpleitk(folder: Path) -> Any:
    reader = sitk.ImageSeriesReader()
    reader.SetFileNames(reader.GetGDCMSeriesFileNames(str(folder)))
    return reader.Execute()


def test_twice_is_as_good_as_once(stuffed: Path, tmp_path: Path) -> None:
    for source, target in ((stuffed, "one"), (stuffed, "two"), (tmp_path / "one", "three")):
        deidentify_folder(source, tmp_path / target)
    contents = [[path.read_bytes() for path in sorted((tmp_path / name).iterdir())] for name in ("one", "two", "three")]
    assert contents[0] == contents[1] == contents[2]


def test_replaced_uids_are_uids_and_differ() -> None:
    made = {replaced_uid(f"1.2.840.{n}") for n in range(2000)}
    assert len(made) == 2000
    assert all(re.fullmatch(r"2\.25\.[1-9][0-9]{0,38}", uid) for uid in made)
    assert all(replaced_uid(uid) == uid for uid in made)
    # Another program's UUID is none of ours, and an absent UID stays absent.
    assert replaced_uid("2.25.329800735698586629295641978511506172918").startswith("2.25.")
    assert replaced_uid("2.25.329800735698586629295641978511506172918") not in (*made, "2.25.3298007")
    assert replaced_uid("") == ""


@pytest.mark.parametrize("first", ["segmentation", "copies"])
def test_a_series_and_its_segmentation_still_belong_together(tmp_path: Path, first: str) -> None:
    """Whether the segmentation is copied with its series, or made of the copies."""
    pytest.importorskip("highdicom")
    tags = {"StudyInstanceUID": generate_uid(), "FrameOfReferenceUID": generate_uid(), "PatientName": "DOE^JOHN"}
    write_series(tmp_path / "in", stored_values(6), StudyDate=DATE, PatientID=SECRET, **tags)
    _, grid = series_slices(tmp_path / "in")
    voxels = np.zeros(grid.shape, dtype=np.uint8)
    voxels[5:20, 8:30, 2:5] = 1
    labels = LabelMap(voxels, grid, {1: "liver"})
    if first == "segmentation":
        (tmp_path / "both").mkdir()
        (tmp_path / "in").rename(tmp_path / "both/images")
        write_segments(tmp_path / "both/DOE.dcm", [labels], tmp_path / "both/images")
        made = deidentify_folder(tmp_path / "both", tmp_path / "out")
        by_size = sorted(made.folders, key=lambda folder: len(list(folder.iterdir())))
        [segmentation], images = copies(by_size[0]), copies(by_size[1])
        found = read_label_maps(next(by_size[0].iterdir()))
    else:
        deidentify_folder(tmp_path / "in", tmp_path / "out")
        write_segments(tmp_path / "made.dcm", [labels], tmp_path / "out")
        segmentation, images = pydicom.dcmread(tmp_path / "made.dcm"), copies(tmp_path / "out")
        found = read_label_maps(tmp_path / "made.dcm")
    content = b"".join(path.read_bytes() for path in [*tmp_path.glob("out/**/*.dcm"), *tmp_path.glob("made.dcm")])
    assert not any(mark.encode() in content for mark in ("DOE", SECRET, DATE, tags["StudyInstanceUID"]))
    assert segmentation.PatientIdentityRemoved == "YES"
    assert segmentation.StudyInstanceUID == images[0].StudyInstanceUID
    assert segmentation.FrameOfReferenceUID == images[0].FrameOfReferenceUID
    [referenced] = segmentation.ReferencedSeriesSequence
    assert referenced.SeriesInstanceUID == images[0].SeriesInstanceUID
    known = {image.SOPInstanceUID for image in images}
    assert {item.ReferencedSOPInstanceUID for item in referenced.ReferencedInstanceSequence} <= known
    [read] = found
    assert read.volume_ml("liver") == pytest.approx(labels.volume_ml("liver"))


def test_only_scans_and_segmentations_come_along(tmp_path: Path) -> None:
    write_series(tmp_path / "in/DOE/a", stored_values(2))
    write_series(tmp_path / "in/DOE/b", stored_values(2), Modality="MR")
    report = slice_dataset(stored_values(1)[0], (0, 0, 0), generate_uid(), SOPClassUID="1.2.840.10008.5.1.4.1.1.88.11")
    report.save_as(tmp_path / "in/report.dcm")
    (tmp_path / "in/notes.txt").write_text("John Doe")
    made = deidentify_folder(tmp_path / "in", tmp_path / "out")
    assert (made.files, made.left_out) == (4, 2)
    assert made.folders == (tmp_path / "out/series1", tmp_path / "out/series2")
    assert np.array_equal(read_volume(made.folders[0]).voxels, read_volume(tmp_path / "in/DOE/a").voxels)


def test_what_cannot_be_copied_is_a_sentence(tmp_path: Path) -> None:
    write_series(tmp_path / "in", stored_values(2))
    (tmp_path / "full").mkdir()
    (tmp_path / "full/mine.txt").write_text("kept")
    for source, target, words in (
        ("in", "in", "which stays as it is"),
        ("in", "in/out", "which stays as it is"),
        ("in", "full", "exists already"),
        ("full", "out", "holds no CT, MR or segmentation"),
        ("nowhere", "out", "is not a folder"),
    ):
        with pytest.raises(BadInput, match=words):
            deidentify_folder(tmp_path / source, tmp_path / target)
    assert (tmp_path / "full/mine.txt").read_text() == "kept"
    assert len(list((tmp_path / "in").iterdir())) == 2
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("error", [KeyboardInterrupt, MemoryError])
def test_an_interruption_leaves_nothing_half_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: type[BaseException]
) -> None:
    write_series(tmp_path / "in", stored_values(4))
    copy = deidentification._copy

    def interrupted(path: Path, place: Path) -> None:
        if place.name == "00003.dcm":
            raise error
        copy(path, place)

    monkeypatch.setattr(deidentification, "_copy", interrupted)
    with pytest.raises((error, BadInput)):
        deidentify_folder(tmp_path / "in", tmp_path / "out")
    assert [path.name for path in tmp_path.iterdir()] == ["in"]
