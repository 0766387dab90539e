import io

import numpy as np
import pytest
from PIL import Image
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGBaseline8Bit,
    JPEGExtended12Bit,
    JPEGLossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    JPEGLSNearLossless,
    RLELossless,
    generate_uid,
)

from dicom_samples import (
    GDCM_LOSSLESS,
    change,
    jpeg_extended,
    jpeg_lossless,
    needs_jpeg_ls,
    recompress,
    set_frames,
    slice_dataset,
    stored_values,
    strip_preamble,
    write_multiframe,
    write_series,
)
from glisson.core import BadInput
from glisson.io.dicom import read_dicom_mask
from glisson.io.images import read_label_maps, read_labels, read_volume
from glisson.io.jpeg_extended import decoded_extended
from glisson.io.jpeg_headers import read_jpeg_frame
from glisson.io.jpeg_lossless import decoded_lossless

LOSSLESS = [
    JPEG2000Lossless,
    RLELossless,
    DeflatedExplicitVRLittleEndian,
    JPEGLossless,
    JPEGLosslessSV1,
    pytest.param(JPEGLSLossless, marks=needs_jpeg_ls),
]


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


@pytest.mark.parametrize("bits", [12, 16])
@pytest.mark.parametrize("signed", [False, True])
@pytest.mark.parametrize("syntax", LOSSLESS)
def test_lossless_series(tmp_path, syntax, signed, bits):
    lowest = -(1 << (bits - 1)) if signed else 0
    pixels = np.random.default_rng(bits).integers(lowest, lowest + (1 << bits), (2, 40, 36))
    pixels[:, 0, :4] = lowest, lowest + (1 << bits) - 1, lowest, lowest + (1 << bits) - 1
    tags = {"BitsStored": bits, "HighBit": bits - 1, "PixelRepresentation": int(signed), "RescaleSlope": 2}
    for path in write_series(tmp_path, pixels.astype(np.int16 if signed else np.uint16), **tags):
        recompress(path, syntax)
    assert np.array_equal(read_volume(tmp_path).voxels, pixels.transpose(2, 1, 0) * 2 - 1024)


@pytest.mark.parametrize("predictor", range(1, 8))
def test_jpeg_lossless_as_coded_by_others(predictor):
    """All that encoders choose: the predictor, restart intervals, and 16 coded bits for 12 stored ones."""
    pixels = stored_values(1)[0]
    for precision in (12, 16):
        for restart_lines in (0, 1, 3):
            frame = read_jpeg_frame(jpeg_lossless(pixels, precision, predictor, restart_lines))
            assert np.array_equal(decoded_lossless(frame), pixels)


def test_frames_in_several_fragments(tmp_path):
    pixels = stored_values(2)
    for path, frame in zip(write_series(tmp_path, pixels), pixels, strict=True):
        set_frames(path, [jpeg_lossless(frame, 12)], JPEGLosslessSV1, fragments=3)
    assert np.array_equal(read_volume(tmp_path).voxels, pixels.transpose(2, 1, 0).astype(int) - 1024)


def test_jpeg_lossless_coded_by_gdcm():
    row, column = np.mgrid[:16, :20]
    pixels = (7 * row**2 + 31 * column + np.where((row + column) % 7 == 0, 900, 0)) % 4096
    assert np.array_equal(decoded_lossless(read_jpeg_frame(GDCM_LOSSLESS)), pixels)


@pytest.mark.parametrize("options", [{"quality": 30}, {"quality": 95}, {"quality": 95, "restart_marker_blocks": 3}])
def test_cosine_blocks_as_pillow_decodes_them(options):
    pixels = (np.random.default_rng(2).integers(-9, 10, (45, 37)).cumsum(axis=1) + 128).clip(0, 255).astype(np.uint8)
    coded = io.BytesIO()
    Image.fromarray(pixels).save(coded, "JPEG", **options)
    ours = decoded_extended(read_jpeg_frame(coded.getvalue())).astype(int)
    # Pillow's cosine transform is in whole numbers: it rounds otherwise.
    assert np.abs(ours - np.asarray(Image.open(coded), dtype=int)).max() <= 1


def test_jpeg_extended_of_12_bits(tmp_path):
    for path in write_series(tmp_path, np.zeros((2, 1024, 256), np.uint16)):
        set_frames(path, [jpeg_extended()], JPEGExtended12Bit)
    voxels = read_volume(tmp_path).voxels[..., 0] + 1024
    # As GDCM 3.2.6 decodes it, whose cosine transform is in whole numbers.
    rows, columns = [421, 420, 229, 221, 240, 155, 364], [143, 136, 145, 137, 140, 128, 146]
    assert np.abs(voxels[columns, rows] - [264, 234, 150, 125, 115, 107, 90]).max() <= 1
    assert voxels.sum() == pytest.approx(3767007, rel=1e-3)


def test_jpeg_baseline(tmp_path):
    pixels = np.full((2, 40, 36), 60, np.uint8)
    pixels[:, 8:24, 8:16] = 200
    coded = io.BytesIO()
    Image.fromarray(pixels[0]).save(coded, "JPEG", quality=100)
    for path in write_series(tmp_path, pixels):
        set_frames(path, [coded.getvalue()], JPEGBaseline8Bit)
    assert np.abs(read_volume(tmp_path).voxels + 1024 - pixels.transpose(2, 1, 0)).max() <= 1


@needs_jpeg_ls
def test_nearly_lossless_series(tmp_path):
    pixels = stored_values(2)
    for path in write_series(tmp_path, pixels):
        recompress(path, JPEGLSNearLossless, jls_error=3)
    error = read_volume(tmp_path).voxels + 1024 - pixels.transpose(2, 1, 0).astype(int)
    assert np.abs(error).max() == 3


@pytest.mark.parametrize("compression", [None, *LOSSLESS[:2], *LOSSLESS[3:]])
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

    monkeypatch.setattr("glisson.io.dicom.stored_frames", refuse)
    paths = write_series(tmp_path, stored_values())
    paths[2].unlink()
    with pytest.raises(BadInput, match=r"a slice is missing between z = -37\.50 and z = -32\.50"):
        read_volume(tmp_path)
