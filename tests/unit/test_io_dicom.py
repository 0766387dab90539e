import numpy as np
import pytest
from pydicom.uid import DeflatedExplicitVRLittleEndian, JPEG2000Lossless, RLELossless, generate_uid

from dicom_samples import (
    change,
    recompress,
    slice_dataset,
    stored_values,
    strip_preamble,
    write_multiframe,
    write_series,
)
from glisson.core import BadInput
from glisson.io.dicom import read_dicom_mask
from glisson.io.images import read_label_maps, read_labels, read_volume


def test_series_is_sorted_by_place_and_rescaled(tmp_path):
    pixels = stored_values()
    write_series(tmp_path, pixels)
    volume = read_volume(tmp_path)
    # Slices were numbered by place, files and instance numbers were not.
    assert np.array_equal(volume.voxels, pixels.transpose(2, 1, 0).astype(int) - 1024)
    assert volume.grid.shape == (36, 40, 6)
    assert volume.grid.spacing_mm.tolist() == [0.7, 0.8, 2.5]  # PixelSpacing is rows first
    assert volume.grid.origin_mm.tolist() == [-30.0, 20.0, -40.0]
    assert volume.voxels.dtype == np.int16
    assert volume.modality == "CT"


def test_voxel_centres_follow_the_standard_formula(tmp_path):
    # PS3.3 C.7.6.2.1.1: P = position + row * spacing between columns * column index + ...
    angle = np.radians(25.0)
    row = np.array([np.cos(angle), np.sin(angle), 0.0])
    column = np.array([0.0, 0.0, -1.0])
    normal = np.cross(row, column)
    pixels = stored_values(4)
    series = generate_uid()
    places = [np.array([11.0, -7.0, 52.0]) + 3.0 * n * normal for n in range(4)]
    for n in (2, 0, 3, 1):
        dataset = slice_dataset(pixels[n], places[n], series, ImageOrientationPatient=[*row, *column])
        dataset.save_as(tmp_path / f"{7 - n}")
    volume = read_volume(tmp_path)
    for n, i, j in ((0, 0, 0), (1, 4, 9), (3, 9, 11)):
        expected = places[n] + row * 0.7 * i + column * 0.8 * j
        assert np.allclose(volume.grid.points_from_indices([[i, j, n]])[0], expected, atol=1e-9)
        assert volume.voxels[i, j, n] == int(pixels[n, j, i]) - 1024


@pytest.mark.parametrize("syntax", [JPEG2000Lossless, RLELossless, DeflatedExplicitVRLittleEndian])
def test_compressed_series(tmp_path, syntax):
    pixels = stored_values(3)
    for path in write_series(tmp_path, pixels):
        recompress(path, syntax)
    assert np.array_equal(read_volume(tmp_path).voxels, pixels.transpose(2, 1, 0).astype(int) - 1024)


@pytest.mark.parametrize("compression", [None, RLELossless, JPEG2000Lossless])
def test_multiframe_with_shared_and_per_frame_groups(tmp_path, compression):
    pixels = stored_values(5)
    write_multiframe(tmp_path / "enhanced.dcm", pixels, [3, 0, 4, 1, 2])
    if compression:
        recompress(tmp_path / "enhanced.dcm", compression)
    volume = read_volume(tmp_path)
    expected = pixels.astype(int) * 2 - 1024 - np.arange(5)[:, None, None]
    assert np.array_equal(volume.voxels, expected.transpose(2, 1, 0))
    assert volume.grid.spacing_mm.tolist() == [0.7, 0.8, 2.5]
    assert volume.grid.origin_mm.tolist() == [-30.0, 20.0, -40.0]


def test_rescale_differs_between_slices(tmp_path):
    pixels = stored_values(3)
    paths = write_series(tmp_path, pixels)
    change(paths[1], RescaleSlope=0.5, RescaleIntercept=10.25)
    volume = read_volume(tmp_path)
    assert volume.voxels.dtype == np.float32
    assert np.array_equal(volume.voxels[..., 1], (pixels[1].T * 0.5 + 10.25).astype(np.float32))
    assert np.array_equal(volume.voxels[..., 2], pixels[2].T.astype(np.float32) - 1024)


def test_signed_values_with_unused_bits(tmp_path):
    # 12 bits stored of 16: the upper four may hold anything.
    signed = np.random.default_rng(3).integers(-2048, 2048, (3, 40, 36)).astype(np.int16)
    dirty = (signed.view(np.uint16) & 0x0FFF) | 0x5000
    write_series(tmp_path, dirty, PixelRepresentation=1, RescaleIntercept=0)
    assert np.array_equal(read_volume(tmp_path).voxels, signed.transpose(2, 1, 0))


def test_mr_needs_no_rescaling(tmp_path):
    pixels = stored_values(3)
    write_series(tmp_path, pixels, Modality="MR", RescaleSlope=None, RescaleIntercept=None)
    volume = read_volume(tmp_path)
    assert volume.modality == "MR"
    assert np.array_equal(volume.voxels, pixels.transpose(2, 1, 0))


def test_files_without_preamble_and_strangers_in_the_folder(tmp_path):
    pixels = stored_values(4)
    for path in write_series(tmp_path, pixels):
        strip_preamble(path)
        assert path.read_bytes()[128:132] != b"DICM"
    (tmp_path / "readme.txt").write_text("no image " * 50)
    (tmp_path / ".hidden").write_bytes(b"\0" * 200)
    (tmp_path / "empty").write_bytes(b"")
    (tmp_path / "DICOMDIR").write_bytes(b"\0" * 128 + b"DICM")
    (tmp_path / "inner").mkdir()
    assert np.array_equal(read_volume(tmp_path).voxels, pixels.transpose(2, 1, 0).astype(int) - 1024)


def test_one_of_several_series(tmp_path):
    pixels = stored_values(4)
    first, second = generate_uid(), generate_uid()
    write_series(tmp_path, pixels, SeriesInstanceUID=first)
    write_series(tmp_path, pixels[:3] // 2, prefix="b", SeriesInstanceUID=second)
    assert read_volume(tmp_path, second).grid.shape[2] == 3
    assert read_volume(tmp_path, first).grid.shape[2] == 4


@pytest.mark.parametrize("inverted", [False, True])
def test_mask_of_either_photometric_interpretation(tmp_path, inverted):
    mask = np.random.default_rng(1).random((3, 40, 36)) < 0.3
    pixels = np.where(mask, 255, 0).astype(np.uint8)
    kind = "MONOCHROME1" if inverted else "MONOCHROME2"
    stored = 255 - pixels if inverted else pixels
    write_series(tmp_path / "livertumor02", stored, PhotometricInterpretation=kind, RescaleSlope=None)
    assert np.array_equal(read_dicom_mask(tmp_path / "livertumor02").voxels, mask.transpose(2, 1, 0))
    labels = read_labels(tmp_path / "livertumor02")
    assert dict(labels.names) == {1: "tumour2"}


def test_mask_folders_are_one_map_each(tmp_path):
    pixels = np.zeros((3, 40, 36), np.uint8)
    pixels[1, 4:8, 3:6] = 255
    for name in ("liver", "livertumor1", "livertumor2", "portalvein", "venoussystem", "spleen"):
        write_series(tmp_path / name, pixels)
    maps = read_label_maps(tmp_path)
    assert [labels.names[1] for labels in maps] == ["liver", "tumour1", "tumour2", "portal", "spleen", "hepatic"]
    assert all(labels.voxels.sum() == 12 for labels in maps)


def test_no_pixel_is_decoded_before_the_geometry_is_checked(tmp_path, monkeypatch):
    def refuse(*_args, **_keywords):
        raise AssertionError("pixels were read")

    monkeypatch.setattr("glisson.io.dicom._decoded", refuse)
    paths = write_series(tmp_path, stored_values())
    paths[2].unlink()
    with pytest.raises(BadInput, match=r"a slice is missing between z = -37\.50 and z = -32\.50"):
        read_volume(tmp_path)
