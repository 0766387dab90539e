"""Segmentations of 3D Slicer and DICOM: round trips without loss, checked with other readers."""

from pathlib import Path

import nrrd
import numpy as np
import pydicom
import pytest
import SimpleITK
from pydicom.pixels import pack_bits
from pydicom.sr.codedict import codes
from pydicom.uid import ExplicitVRLittleEndian, SegmentationStorage, generate_uid

from dicom_samples import item, write_series
from glisson.core import BadInput, Grid, LabelMap
from glisson.io.dicom import read_dicom_folder
from glisson.io.dicom_segmentation import _ALGORITHM
from glisson.io.images import read_label_maps, read_labels, write_segments
from glisson.io.label_groups import on_grid_of
from glisson.io.structure_codes import CODES


def overlapping_maps(grid: Grid) -> list[LabelMap]:
    """A liver with a tumour and two vessels in it, none of which reaches the first or last slice."""
    organ, tumours, vessels = (np.zeros(grid.shape, np.uint8) for _ in range(3))
    organ[4:20, 5:25, 3:9] = 1
    tumours[8:12, 9:13, 5:7] = 1
    vessels[4:20, 15, 5] = 1
    vessels[12, 5:14, 6] = 2
    return [
        LabelMap(organ, grid, {1: "liver"}),
        LabelMap(tumours, grid, {1: "tumour1"}),
        LabelMap(vessels, grid, {1: "portal", 2: "hepatic"}),
    ]


def masks(maps) -> dict[str, np.ndarray]:
    return {name: labels.mask(name) for labels in maps for name in labels.names.values()}


@pytest.fixture
def scan_folder(tmp_path) -> Path:
    pixels = np.random.default_rng(1).integers(0, 4096, (12, 40, 36)).astype(np.uint16)
    tags = {"StudyInstanceUID": generate_uid(), "FrameOfReferenceUID": generate_uid(), "PatientID": "P7"}
    write_series(tmp_path / "scan", pixels, **tags)
    return tmp_path / "scan"


def oblique_grid() -> Grid:
    rotation, _ = np.linalg.qr(np.random.default_rng(11).normal(size=(3, 3)))
    return Grid((36, 40, 12), [0.7, 0.9, 2.5], [-110.25, 33.5, 812.125], rotation)


def test_slicer_segmentation_round_trip(tmp_path):
    maps = overlapping_maps(oblique_grid())
    write_segments(tmp_path / "liver.seg.nrrd", maps)
    back = read_label_maps(tmp_path / "liver.seg.nrrd")
    assert len(back) == 3
    wanted = masks(maps)
    for name, mask in masks(back).items():
        assert np.array_equal(mask, wanted[name]), name
    assert set(masks(back)) == set(wanted)
    assert all(labels.grid.matches(maps[0].grid, 1e-9) for labels in back)
    assert [file.name for file in tmp_path.iterdir()] == ["liver.seg.nrrd"]


def test_simpleitk_reads_what_we_write_for_slicer(tmp_path):
    maps = overlapping_maps(oblique_grid())
    write_segments(tmp_path / "a.seg.nrrd", maps)
    image = SimpleITK.ReadImage(str(tmp_path / "a.seg.nrrd"))
    voxels = SimpleITK.GetArrayFromImage(image)  # (k, j, i, layer)
    for layer, labels in enumerate(maps):
        assert np.array_equal(voxels[..., layer].T, labels.voxels)
    assert np.allclose(image.GetSpacing(), maps[0].grid.spacing_mm)
    assert np.allclose(image.GetOrigin(), maps[0].grid.origin_mm)
    assert np.allclose(np.reshape(image.GetDirection(), (3, 3)), maps[0].grid.direction)
    assert image.GetMetaData("Segment2_Name") == "portal"
    assert image.GetMetaData("Segment2_Layer") == "2"


def test_one_layer_is_a_plain_volume_for_slicer(tmp_path):
    write_segments(tmp_path / "a.seg.nrrd", overlapping_maps(oblique_grid())[2:])
    voxels, header = nrrd.read(str(tmp_path / "a.seg.nrrd"))
    assert voxels.ndim == 3
    assert (header["Segment0_Name"], header["Segment1_LabelValue"]) == ("portal", "2")
    assert dict(read_labels(tmp_path / "a.seg.nrrd").names) == {1: "portal", 2: "hepatic"}


def test_what_slicer_crops_comes_back_onto_the_scan(tmp_path):
    grid = oblique_grid()
    whole = overlapping_maps(grid)[0]
    part = Grid((16, 20, 6), grid.spacing_mm, grid.points_from_indices([[4, 5, 3]])[0], grid.direction)
    write_segments(tmp_path / "a.seg.nrrd", [LabelMap(whole.voxels[4:20, 5:25, 3:9], part, {1: "Liver"})])
    placed = on_grid_of(grid, read_labels(tmp_path / "a.seg.nrrd"), "it")
    assert np.array_equal(placed.voxels, whole.voxels)
    assert dict(placed.names) == {1: "liver"}


def test_labels_beyond_the_scan_are_refused():
    grid = oblique_grid()
    beyond = Grid(grid.shape, grid.spacing_mm, grid.points_from_indices([[-30, 0, 0]])[0], grid.direction)
    whole = overlapping_maps(beyond)[0]
    with pytest.raises(BadInput, match="another grid"):
        on_grid_of(grid, whole, "it")
    between = Grid(grid.shape, grid.spacing_mm, grid.points_from_indices([[0.5, 0, 0]])[0], grid.direction)
    with pytest.raises(BadInput, match="another grid"):
        on_grid_of(grid, overlapping_maps(between)[0], "it")


def test_old_slicer_has_a_layer_for_each_segment(tmp_path):
    voxels = np.zeros((2, 5, 6, 7), np.uint8)
    voxels[0, 1:4, 2, 3] = 1
    voxels[1, 1:4, 2:4, 3] = 1
    header = {
        "space": "left-posterior-superior",
        "kinds": ["list", "domain", "domain", "domain"],
        "space directions": np.vstack([np.full((1, 3), np.nan), np.eye(3)]),
        "space origin": [0, 0, 0],
        "Segment0_ID": "Segment_1",
        "Segment0_Name": "Portal vein",
        "Segment1_ID": "Segment_2",
        "Segment1_Name": "liver",
    }
    nrrd.write(str(tmp_path / "a.seg.nrrd"), voxels, header)
    found = masks(read_label_maps(tmp_path / "a.seg.nrrd"))
    assert np.array_equal(found["portal"], voxels[0] == 1)
    assert np.array_equal(found["liver"], voxels[1] == 1)
    with pytest.raises(BadInput, match="2 label maps"):
        read_labels(tmp_path / "a.seg.nrrd")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"Segment0_Layer": "4"}, "lies in layer 4, but there are 1"),
        ({"Segment1_ID": "b", "Segment1_LabelValue": "1", "Segment1_Layer": "0"}, "share label 1"),
        ({"Segment0_LabelValue": "one"}, "cannot be read"),
    ],
)
def test_contradictory_segments_are_refused(tmp_path, change, reason):
    header = {"space": "LPS", "space directions": np.eye(3), "space origin": [0, 0, 0], "Segment0_ID": "a"} | change
    nrrd.write(str(tmp_path / "a.seg.nrrd"), np.ones((3, 4, 5), np.uint8), header)
    with pytest.raises(BadInput, match=reason):
        read_label_maps(tmp_path / "a.seg.nrrd")


def test_dicom_segmentation_round_trip(tmp_path, scan_folder):
    maps = overlapping_maps(read_dicom_folder(scan_folder).grid)
    write_segments(tmp_path / "liver.dcm", maps, scan_folder)
    back = read_label_maps(tmp_path / "liver.dcm")
    wanted = masks(maps)
    found = {
        name: labels.mask(name)
        for labels in (on_grid_of(maps[0].grid, part, "it") for part in back)
        for name in labels.names.values()
    }
    assert set(found) == set(wanted)
    for name, mask in found.items():
        assert np.array_equal(mask, wanted[name]), name
    # Empty frames were dropped, so what was read is shorter than the scan.
    assert back[0].grid.shape[2] == 6


def test_pydicom_reads_what_we_write(tmp_path, scan_folder):
    maps = overlapping_maps(read_dicom_folder(scan_folder).grid)
    write_segments(tmp_path / "liver.dcm", maps, scan_folder)
    dataset = pydicom.dcmread(tmp_path / "liver.dcm")
    scan = pydicom.dcmread(next(scan_folder.iterdir()))
    assert dataset.SOPClassUID == SegmentationStorage
    assert (dataset.StudyInstanceUID, dataset.PatientID) == (scan.StudyInstanceUID, scan.PatientID)
    assert [segment.SegmentLabel for segment in dataset.SegmentSequence] == ["liver", "tumour1", "portal", "hepatic"]
    assert dataset.SegmentSequence[0].SegmentedPropertyTypeCodeSequence[0].CodeValue == "10200004"
    wanted = masks(maps)
    affine = np.linalg.inv(maps[0].grid.lps_from_index)
    seen = 0
    for group, frame in zip(dataset.PerFrameFunctionalGroupsSequence, dataset.pixel_array, strict=True):
        number = group.SegmentIdentificationSequence[0].ReferencedSegmentNumber
        place = np.array([*group.PlanePositionSequence[0].ImagePositionPatient, 1.0])
        k = round(float((affine @ place)[2]))
        name = dataset.SegmentSequence[number - 1].SegmentLabel
        assert np.array_equal(frame.T == 1, wanted[name][:, :, k])
        seen += int(frame.sum())
    assert seen == sum(int(mask.sum()) for mask in wanted.values())


def test_dicom_segmentation_of_an_oblique_scan(tmp_path, scan_folder):
    """Empty frames between and about: each voxel lies where pydicom says that its frame does, and all come back."""
    grid = oblique_grid()
    rotation = grid.direction * [1.0, 1.0, np.linalg.det(grid.direction)]  # images have a right-handed frame
    for path in scan_folder.iterdir():
        image = pydicom.dcmread(path)
        k = round((image.ImagePositionPatient[2] + 40.0) / 2.5)
        image.ImageOrientationPatient = [f"{x:.12g}" for x in rotation[:, :2].T.ravel()]
        image.ImagePositionPatient = [f"{x:.12g}" for x in rotation @ [0.0, 0.0, 2.5 * k] + [-110.25, 33.5, 812.125]]
        image.save_as(path)
    scan = read_dicom_folder(scan_folder).grid
    voxels = np.zeros(scan.shape, np.uint8)
    voxels[3:9, 4:20, 2:4], voxels[20:30, 4:9, 3], voxels[5:12, 30:38, 8:10] = 1, 2, 1
    labels = LabelMap(voxels, scan, {1: "liver", 2: "gallbladder"})
    write_segments(tmp_path / "a.dcm", [labels], scan_folder)
    back = [on_grid_of(scan, part, "it") for part in read_label_maps(tmp_path / "a.dcm")]
    assert all(np.array_equal(mask, labels.mask(name)) for name, mask in masks(back).items())
    assert set(masks(back)) == {"liver", "gallbladder"}
    dataset = pydicom.dcmread(tmp_path / "a.dcm")
    shared = dataset.SharedFunctionalGroupsSequence[0]
    axes = np.reshape(shared.PlaneOrientationSequence[0].ImageOrientationPatient, (2, 3))
    between_rows, between_columns = shared.PixelMeasuresSequence[0].PixelSpacing
    found = []
    for group, frame in zip(dataset.PerFrameFunctionalGroupsSequence, dataset.pixel_array, strict=True):
        rows, columns = np.nonzero(frame)
        steps = np.stack([columns * between_columns, rows * between_rows], axis=1)
        found.append(np.array(group.PlanePositionSequence[0].ImagePositionPatient, float) + steps @ axes)
    wanted = scan.points_from_indices(np.argwhere(voxels))
    order = [np.lexsort(np.round(points, 2).T) for points in (wanted, np.concatenate(found))]
    assert np.abs(wanted[order[0]] - np.concatenate(found)[order[1]]).max() < 1e-3


def test_one_of_several_series_is_referred_to(tmp_path, scan_folder):
    grid = read_dicom_folder(scan_folder).grid
    wanted = pydicom.dcmread(next(scan_folder.iterdir())).SeriesInstanceUID
    write_series(scan_folder, np.zeros((3, 40, 36), np.uint16), prefix="other")
    with pytest.raises(BadInput, match="mixes 2 series; choose one"):
        write_segments(tmp_path / "a.dcm", overlapping_maps(grid), scan_folder)
    write_segments(tmp_path / "a.dcm", overlapping_maps(grid), scan_folder, wanted)
    assert pydicom.dcmread(tmp_path / "a.dcm").ReferencedSeriesSequence[0].SeriesInstanceUID == wanted


def test_codes_are_those_of_the_standard():
    """pydicom has DICOM's own tables of SNOMED codes."""
    listed = [code.value for code in (getattr(codes.SCT, name) for name in codes.SCT.dir())]
    for name, code in CODES.items():
        assert code.scheme == "SCT"
        assert code.value in listed, name
        assert any(word in code.meaning.lower() for word in (name, "vein", "vena", "artery", "bile", "wire"))
    assert codes.cid7162.DeformableModels.value == _ALGORITHM.value


NEOPLASM = ("108369006", "SCT", "Neoplasm")


def foreign_segmentation(
    path: Path,
    frames: np.ndarray,
    places: list[float],
    numbers: list[int],
    labels: tuple[str, ...] = ("Leber", "Lesion 7"),
    types: tuple[tuple[str, str, str], ...] = (("10200004", "SCT", "Liver"), NEOPLASM),
) -> None:
    """A segmentation of another program: bits packed, frames in no order, empty ones left out."""
    meta = pydicom.dataset.FileMetaDataset()
    meta.MediaStorageSOPClassUID = SegmentationStorage
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    dataset = pydicom.dataset.FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    values = {
        "SOPClassUID": SegmentationStorage,
        "SOPInstanceUID": meta.MediaStorageSOPInstanceUID,
        "StudyInstanceUID": generate_uid(),
        "SeriesInstanceUID": generate_uid(),
        "FrameOfReferenceUID": generate_uid(),
        "Modality": "SEG",
        "SegmentationType": "BINARY",
        "Rows": frames.shape[1],
        "Columns": frames.shape[2],
        "NumberOfFrames": len(frames),
        "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2",
        "BitsAllocated": 1,
        "BitsStored": 1,
        "HighBit": 0,
        "PixelRepresentation": 0,
        "SegmentsOverlap": "YES",
        "SharedFunctionalGroupsSequence": item(
            PlaneOrientationSequence=item(ImageOrientationPatient=[1, 0, 0, 0, 1, 0]),
            PixelMeasuresSequence=item(PixelSpacing=[0.8, 0.7], SliceThickness=2.5, SpacingBetweenSlices=2.5),
        ),
        "SegmentSequence": [
            item(
                SegmentNumber=n,
                SegmentLabel=label,
                SegmentAlgorithmType="MANUAL",
                SegmentedPropertyCategoryCodeSequence=item(
                    CodeValue="91723000", CodingSchemeDesignator="SCT", CodeMeaning="Anatomical Structure"
                ),
                SegmentedPropertyTypeCodeSequence=item(
                    CodeValue=kind[0], CodingSchemeDesignator=kind[1], CodeMeaning=kind[2]
                ),
            )[0]
            for n, (label, kind) in enumerate(zip(labels, types, strict=True), start=1)
        ],
        "PerFrameFunctionalGroupsSequence": [
            item(
                PlanePositionSequence=item(ImagePositionPatient=[-30.0, 20.0, z]),
                SegmentIdentificationSequence=item(ReferencedSegmentNumber=n),
                FrameContentSequence=item(DimensionIndexValues=[n, 1 + round(z / 2.5 + 16)]),
            )[0]
            for z, n in zip(places, numbers, strict=True)
        ],
        "DimensionOrganizationSequence": item(DimensionOrganizationUID="1.2.3"),
        "DimensionIndexSequence": [
            item(
                DimensionOrganizationUID="1.2.3",
                DimensionIndexPointer=pointer,
                FunctionalGroupPointer=group,
            )[0]
            for pointer, group in ((0x0062000B, 0x0062000A), (0x00200032, 0x00209113))
        ],
    }
    for keyword, value in values.items():
        setattr(dataset, keyword, value)
    dataset.PixelData = pack_bits(frames.astype(np.uint8))
    dataset["PixelData"].VR = "OB"
    dataset.save_as(path)


def test_segmentation_of_another_program(tmp_path, scan_folder):
    grid = read_dicom_folder(scan_folder).grid
    random = np.random.default_rng(3)
    # Slices 2, 3 and 7 of the liver and 7 of a lesion; those between are empty and missing.
    slices, numbers = [7, 2, 7, 3], [1, 1, 2, 1]
    frames = random.random((4, 40, 36)) < 0.3
    foreign_segmentation(tmp_path / "seg", frames, [-40.0 + 2.5 * k for k in slices], numbers)
    maps = [on_grid_of(grid, labels, "it") for labels in read_label_maps(tmp_path / "seg")]
    assert len(maps) == 2  # they overlap
    found = masks(maps)
    for name, number in (("liver", 1), ("tumour7", 2)):
        wanted = np.zeros(grid.shape, bool)
        for frame, k, of in zip(frames, slices, numbers, strict=True):
            wanted[:, :, k] |= frame.T if of == number else False
        assert np.array_equal(found[name], wanted), name


@pytest.mark.parametrize(
    ("label", "kind", "name"),
    [
        ("Pfortader", ("32764006", "SCT", "Portal vein"), "portal"),
        ("Leber", ("T-62000", "SRT", "Liver"), "liver"),  # the same code before 2018
        ("hepatic", ("10200004", "SCT", "Liver"), "hepatic"),  # the label is clearer than the code
        ("Milz", ("78961009", "SCT", "Spleen"), "Milz"),
    ],
)
def test_names_of_foreign_segments(tmp_path, label, kind, name):
    frames = np.ones((3, 40, 36), bool)
    foreign_segmentation(tmp_path / "seg", frames, [0.0, 2.5, 5.0], [1, 1, 2], (label, "Lesion 7"), (kind, NEOPLASM))
    assert set(masks(read_label_maps(tmp_path / "seg"))) == {name, "tumour7"}


def test_a_mask_series_is_read_though_other_files_lie_beside_it(tmp_path, scan_folder):
    write_segments(scan_folder / "zz.seg.nrrd", overlapping_maps(read_dicom_folder(scan_folder).grid))
    (labels,) = read_label_maps(scan_folder)
    assert dict(labels.names) == {1: "scan"}


def test_frames_far_apart_do_not_fill_the_memory(tmp_path):
    frames = np.ones((3, 40, 36), bool)
    foreign_segmentation(tmp_path / "seg.dcm", frames, [0.0, 2.5, 2.5e6], [1, 1, 1])
    with pytest.raises(BadInput, match=r"crop or resample|regular grid"):
        read_label_maps(tmp_path / "seg.dcm")


def test_truncated_segmentation_is_one_sentence(tmp_path, scan_folder):
    write_segments(tmp_path / "a.dcm", overlapping_maps(read_dicom_folder(scan_folder).grid), scan_folder)
    content = (tmp_path / "a.dcm").read_bytes()
    for part in (len(content) // 3, len(content) - 100):
        (tmp_path / "b.dcm").write_bytes(content[:part])
        with pytest.raises(BadInput) as caught:
            read_label_maps(tmp_path / "b.dcm")
        assert str(caught.value).startswith(str(tmp_path / "b.dcm"))


def test_segmentations_need_their_scan_and_a_known_suffix(tmp_path, scan_folder):
    maps = overlapping_maps(read_dicom_folder(scan_folder).grid)
    with pytest.raises(BadInput, match="give their DICOM folder"):
        write_segments(tmp_path / "a.dcm", maps)
    with pytest.raises(BadInput, match=r"written as .seg.nrrd or .dcm"):
        write_segments(tmp_path / "a.nii.gz", maps)
    with pytest.raises(BadInput, match="another grid"):
        write_segments(tmp_path / "a.dcm", overlapping_maps(oblique_grid()), scan_folder)
    write_series(tmp_path / "stripped", np.zeros((12, 40, 36), np.uint16))
    with pytest.raises(BadInput, match="lack StudyInstanceUID and FrameOfReferenceUID"):
        write_segments(tmp_path / "a.dcm", maps, tmp_path / "stripped")
    assert not list(tmp_path.glob("a.*"))
