import io
import multiprocessing
import shutil
import time
import zlib

import numpy as np
import pydicom
import pytest
from PIL import Image
from pydicom.encaps import encapsulate
from pydicom.pixels.decoders.base import get_decoder
from pydicom.uid import (
    DeflatedExplicitVRLittleEndian,
    JPEG2000Lossless,
    JPEGBaseline8Bit,
    JPEGExtended12Bit,
    JPEGLossless,
    JPEGLosslessSV1,
    JPEGLSLossless,
    RLELossless,
    generate_uid,
)

from dicom_samples import (
    change,
    frames_of,
    jpeg_extended,
    needs_jpeg_ls,
    recompress,
    set_frames,
    slice_dataset,
    stored_values,
    write_multiframe,
    write_series,
)
from glisson.core import BadInput
from glisson.io.images import read_label_maps, read_labels, read_volume


def refused(path, complaint, read=read_volume):
    with pytest.raises(BadInput) as caught:
        read(path)
    sentence = str(caught.value)
    assert complaint in sentence
    assert "\n" not in sentence
    return sentence


def test_a_folder_without_dicom(tmp_path):
    (tmp_path / "notes.txt").write_text("nothing here " * 30)
    (tmp_path / "picture.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"\0" * 300)
    refused(tmp_path, "the folder holds no DICOM images.")
    write_series(tmp_path / "SE0", stored_values(2))
    write_series(tmp_path / "SE1", stored_values(2))
    refused(tmp_path, "holds no DICOM images; its folders SE0, SE1 do, so give one of them")
    (tmp_path / "none").mkdir()
    refused(tmp_path / "none", "no folder with DICOM masks", read_label_maps)
    refused(tmp_path / "absent", "does not exist", read_label_maps)


def test_an_archive_is_to_be_unpacked_first(tmp_path):
    for name in ("PATIENT_DICOM.tar.xz", "dicom.zip"):
        (tmp_path / name).write_bytes(b"x" * 100)
        refused(tmp_path / name, "is an archive; unpack it first and give the folder")


def test_mixed_series_are_listed(tmp_path):
    one, two = generate_uid(), generate_uid()
    write_series(tmp_path, stored_values(4), SeriesInstanceUID=one, SeriesDescription="arterial")
    write_series(tmp_path, stored_values(3), prefix="b", SeriesInstanceUID=two, SeriesDescription="portal")
    sentence = refused(tmp_path, "mixes 2 series; choose one")
    assert f"{one} (CT 'arterial', 4 images)" in sentence
    assert f"{two} (CT 'portal', 3 images)" in sentence
    with pytest.raises(BadInput, match=r"there is no series 1\.2\.3"):
        read_volume(tmp_path, "1.2.3")


def test_gaps_say_where(tmp_path):
    paths = write_series(tmp_path, stored_values(8))
    paths[3].unlink()
    refused(tmp_path, "a slice is missing between z = -35.00 and z = -30.00 mm (the usual step is 2.50 mm); complete")
    paths[6].unlink()
    refused(tmp_path, ", and 1 more gaps")


def test_two_slices_at_one_place(tmp_path):
    paths = write_series(tmp_path, stored_values(5))
    shutil.copy(paths[2], tmp_path / "copy")
    sentence = refused(tmp_path, "1 slices lie where another one lies (z = -35.00")
    assert "copy" in sentence
    assert paths[2].name in sentence


def test_uneven_spacing(tmp_path):
    paths = write_series(tmp_path, stored_values(6))
    change(paths[3], ImagePositionPatient=[-30.0, 20.0, -33.0])
    refused(tmp_path, "unevenly spaced (2.000 to 3.000 mm, worst near z = -33.00)")


def test_positions_rounded_to_a_tenth_are_even_enough(tmp_path):
    paths = write_series(tmp_path, stored_values(6), step=0.625)
    for number, path in enumerate(paths):
        change(path, ImagePositionPatient=[-30.0, 20.0, round(-40.0 + 0.625 * number, 1)])
    assert read_volume(tmp_path).grid.spacing_mm[2] == pytest.approx(0.625, abs=0.02)


def test_gantry_tilt_and_shifted_slices(tmp_path):
    paths = write_series(tmp_path / "tilted", stored_values(6))
    for number, path in enumerate(paths):
        place = 2.5 * number
        change(path, ImagePositionPatient=[-30.0, 20.0 + np.tan(np.radians(12.0)) * place, -40.0 + place])
    refused(tmp_path / "tilted", "the gantry was tilted by 12.0°, so the scan is sheared; resample it first")
    paths = write_series(tmp_path / "moved", stored_values(6))
    change(paths[2], ImagePositionPatient=[-28.0, 20.0, -35.0])
    refused(tmp_path / "moved", "shifted sideways against each other by up to 2.00 mm")


@pytest.mark.parametrize(
    ("tags", "complaint"),
    [
        ({"ImageOrientationPatient": [1, 0, 0, 0, 0, -1]}, "differ in orientation"),
        ({"ImageOrientationPatient": [1, 0, 0, 1, 0, 0]}, "not perpendicular unit vectors"),
        ({"ImageOrientationPatient": [0, 0, 0, 0, 0, 0]}, "not perpendicular unit vectors"),
        ({"PixelSpacing": [0.8, 0.71]}, "differ in pixel spacing: [0.7, 0.8] mm"),
        ({"PixelSpacing": [0.8, 0.0]}, "PixelSpacing 0.8 × 0.0 mm is not positive"),
        ({"PixelSpacing": [0.8, -0.7]}, "is not positive"),
        ({"PixelSpacing": [0.8]}, "its PixelSpacing must be 2 finite numbers"),
        ({"PixelSpacing": None}, "it lacks PixelSpacing (0028,0030), so it cannot be used"),
        ({"ImagePositionPatient": None}, "it lacks ImagePositionPatient (0020,0032)"),
        (
            {"ImageOrientationPatient": None, "RescaleSlope": None},
            "it lacks ImageOrientationPatient (0020,0037) and RescaleSlope (0028,1053)",
        ),
        ({"RescaleIntercept": None}, "it lacks RescaleIntercept (0028,1052)"),
        ({"BitsAllocated": None}, "it lacks BitsAllocated (0028,0100)"),
        ({"RescaleSlope": 0}, "has the rescale slope 0"),
        ({"SamplesPerPixel": 3}, "it is a colour image, no scan"),
        ({"BitsAllocated": 64}, "its 64 bits per pixel are not read"),
        ({"Rows": 41}, "differ in size"),
        ({"Rows": 65535, "Columns": 65535}, "asks for 65535 × 65535 × 1 voxels (8.6 GB)"),
        ({"NumberOfFrames": 2**31 - 1}, "asks for"),
        ({"NumberOfFrames": 3}, "too short for the 36 × 40 × 3 pixels that its header announces"),
        ({"PixelData": None}, "too short for the 36 × 40 × 1 pixels"),
    ],
)
def test_headers_that_lie(tmp_path, tags, complaint):
    paths = write_series(tmp_path, stored_values(5))
    change(paths[2], **tags)
    sentence = refused(tmp_path, complaint)
    if "differ" not in complaint:
        assert paths[2].name in sentence


def test_numbers_that_are_none(tmp_path):
    paths = write_series(tmp_path, stored_values(3))
    content = paths[1].read_bytes()
    place = content.index(b"-37.5")
    paths[1].write_bytes(content[:place] + b"-3x.5" + content[place + 5 :])
    refused(tmp_path, paths[1].name)


def test_one_slice_is_no_volume(tmp_path):
    write_series(tmp_path, stored_values(1))
    refused(tmp_path, "needs at least two slices, but there is 1")


def test_other_modalities(tmp_path):
    write_series(tmp_path / "us", stored_values(2), Modality="US")
    refused(tmp_path / "us", "its modality is US; Glisson reads CT and MR")
    write_series(tmp_path / "none", stored_values(2), Modality=None)
    refused(tmp_path / "none", "its modality is missing")


def test_tiny_frames_that_ask_for_gigabytes(tmp_path, memory_below):
    """64 bytes of run-length code announced as 65535 × 65535 pixels, or as an honest-looking 20000 × 20000."""
    for name, size, complaint in (
        ("huge", 65535, "asks for 65535 × 65535 × 1 voxels (8.6 GB)"),
        ("large", 20000, "too short for the 20000 × 20000 × 1 pixels"),
    ):
        for path in write_series(tmp_path / name, stored_values(2)):
            dataset = pydicom.dcmread(path)
            dataset.Rows = dataset.Columns = size
            dataset.file_meta.TransferSyntaxUID = RLELossless
            dataset.PixelData = encapsulate([b"\x02\0\0\0\x40\0\0\0" + b"\0" * 56])
            dataset["PixelData"].is_undefined_length = True
            dataset.save_as(path)
        with memory_below(5e6):
            refused(tmp_path / name, complaint)


def test_a_codestream_larger_than_its_header(tmp_path):
    paths = write_series(tmp_path, stored_values(2))
    for path in paths:
        recompress(path, JPEG2000Lossless)
    frame = bytearray(frames_of(paths[0])[0])
    place = frame.index(b"\xff\x4f\xff\x51") + 8
    frame[place : place + 8] = np.array([60000, 60000], ">u4").tobytes()
    set_frames(paths[0], [bytes(frame)])
    refused(tmp_path, "its JPEG 2000 image has 60000 × 60000 pixels, its header says 36 × 40")


def test_packed_pixels_that_are_absent(tmp_path):
    paths = write_series(tmp_path, stored_values(2))
    for path in paths:
        recompress(path, JPEG2000Lossless)
    change(paths[0], PixelData=None)
    refused(tmp_path, "it lacks PixelData (7FE0,0010)")


def test_a_deflated_file_that_unpacks_to_gigabytes(tmp_path, monkeypatch, memory_below):
    monkeypatch.setattr("glisson.io.dicom_headers.MAX_IMAGE_BYTES", 20_000_000)
    path = write_series(tmp_path, stored_values(2))[0]
    recompress(path, DeflatedExplicitVRLittleEndian)
    dataset = pydicom.dcmread(path)
    del dataset.PixelData
    dataset.save_as(path, enforce_file_format=True)
    content = path.read_bytes()
    start = 144 + int.from_bytes(content[140:144], "little")  # after the file's meta information
    plain = zlib.decompress(content[start:], -15)
    bomb = plain + b"\x09\x00\x10\x10OB\0\0" + np.uint32(80_000_000).tobytes() + b"\0" * 80_000_000
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    path.write_bytes(content[:start] + packer.compress(bomb) + packer.flush())
    assert path.stat().st_size < 200_000
    with memory_below(10e6):
        refused(tmp_path, "it unpacks to more than 0.0 GB")


def test_pixels_cut_short(tmp_path):
    paths = write_series(tmp_path, stored_values(3))
    paths[1].write_bytes(paths[1].read_bytes()[:-500])
    refused(tmp_path, paths[1].name)


def test_a_syntax_without_decoder(tmp_path, monkeypatch):
    for path in write_series(tmp_path, stored_values(2)):
        set_frames(path, [b"\xff\xd8" + b"\0" * 100 + b"\xff\xd9"], JPEGLSLossless)
    monkeypatch.setattr("pydicom.pixels.decoders.base.Decoder.is_available", False)
    sentence = refused(tmp_path, "JPEG-LS Lossless Image Compression needs a decoder that is not installed")
    assert "pylibjpeg" in sentence
    for path in tmp_path.iterdir():
        set_frames(path, [bytes(100)], pydicom.uid.MPEG2MPML)
    refused(tmp_path, "is not read; save it uncompressed (Explicit VR Little Endian) with another program first")


def coded(folder, syntax):
    """The first file of a series in a JPEG syntax, and its frame."""
    pixels = stored_values(2)
    if syntax == JPEGBaseline8Bit:
        pixels = (pixels >> 4).astype(np.uint8)
    if syntax == JPEGExtended12Bit:
        pixels = np.zeros((2, 1024, 256), np.uint16)
    paths = write_series(folder, pixels)
    for path, frame in zip(paths, pixels, strict=True):
        if syntax == JPEGBaseline8Bit:
            content = io.BytesIO()
            Image.fromarray(frame).save(content, "JPEG")
            set_frames(path, [content.getvalue()], syntax)
        elif syntax == JPEGExtended12Bit:
            set_frames(path, [jpeg_extended()], syntax)
        else:
            recompress(path, syntax)
    return paths[0], frames_of(paths[0])[0]


JPEG_SYNTAXES = [
    JPEGBaseline8Bit,
    JPEGExtended12Bit,
    JPEGLossless,
    JPEGLosslessSV1,
    pytest.param(JPEGLSLossless, marks=needs_jpeg_ls),
]


@pytest.mark.parametrize("syntax", JPEG_SYNTAXES)
def test_jpeg_frames_that_lie(tmp_path, syntax):
    path, frame = coded(tmp_path, syntax)
    start = frame.index(bytes([0xFF, {JPEGBaseline8Bit: 0xC0, JPEGExtended12Bit: 0xC1}.get(syntax, frame[3])]))
    entropy_coded = frame.index(b"\xff\xda") + 10
    noise = np.random.default_rng(8).integers(0, 255, 3000, dtype=np.uint8).tobytes()

    def changed(place, *values):
        return frame[:place] + bytes(values) + frame[place + len(values) :]

    for content, complaint in (
        (noise, "its JPEG pixels are damaged (they do not start as JPEG does), so get the file again."),
        (b"\xff\xd8\xff\xd9", "damaged (a marker is missing)"),
        (frame[:start] + frame[entropy_coded - 10 :], "damaged (one frame header is needed)"),
        (frame[: len(frame) // 2], "damaged (they are cut off)"),
        (frame[: start + 8], "damaged (they are cut off)"),
        (frame[: start + 8] + b"\xff\xd9", "damaged (a header is cut off)"),
        (changed(start + 2, 0, 0), "damaged (a marker is missing)"),
        (changed(start + 9, 3), "damaged (they are not of one component in one scan)"),
        (changed(len(frame) // 2, 0xFF, 0xD8), "damaged (a marker stands amid them)"),
        (changed(start + 5, 0xEA, 0x60, 0xEA, 0x60), "its JPEG image has 60000 × 60000 pixels, its header says"),
        (changed(start + 4, 17), "its JPEG image has 17 bits a pixel, its header says"),
        (changed(start + 1, 0xC5), "damaged" if syntax == JPEGLSLossless else "its pixels are not coded as its"),
    ):
        set_frames(path, [content])
        assert path.name in refused(tmp_path, complaint)


@pytest.mark.parametrize("syntax", [JPEGLosslessSV1, JPEGExtended12Bit])
def test_jpeg_pixels_that_do_not_fit_their_header(tmp_path, syntax):
    path, frame = coded(tmp_path, syntax)
    start, end = frame.index(b"\xff\xda") + 10, frame.rindex(b"\xff\xd9")
    third = (end - start) // 3
    noise = np.random.default_rng(11).integers(0, 255, end - start, dtype=np.uint8).tobytes()
    for pixels in (
        b"",
        noise,
        frame[start : start + third] + frame[start + 2 * third : end],
        frame[start : start + 2 * third] + frame[start + third : end],
        frame[start:end] + b"\x11\x11",
    ):
        set_frames(path, [frame[:start] + pixels + frame[end:]])
        refused(tmp_path, "its JPEG pixels are damaged (")


def read_mutated(folder, syntaxes):
    sentences = []
    for syntax in syntaxes:
        path, frame = coded(folder / syntax, syntax)
        rng = np.random.default_rng(13)
        for trial in range(24):
            content = bytearray(frame)
            if trial % 4 == 0:
                content = content[: int(rng.integers(2, len(content)))]
            else:
                for place in rng.integers(0, len(content) if trial % 4 == 1 else 60, int(rng.integers(1, 5))):
                    content[place] = int(rng.integers(256))
            set_frames(path, [bytes(content)])
            try:
                read_volume(folder / syntax)
            except BadInput as error:
                sentences.append(str(error))
    assert len(sentences) > 12 * len(syntaxes)
    assert not any("\n" in sentence for sentence in sentences)


def test_mutated_frames_never_end_the_process(tmp_path):
    syntaxes = [JPEGLosslessSV1, *([JPEGLSLossless] if get_decoder(JPEGLSLossless).is_available else [])]
    child = multiprocessing.get_context("spawn").Process(target=read_mutated, args=(tmp_path, syntaxes))
    child.start()
    child.join(60.0)
    child.kill()
    assert child.exitcode == 0


def test_frames_and_their_descriptions(tmp_path):
    pixels = stored_values(4)
    write_multiframe(tmp_path / "a.dcm", pixels, [0, 1, 2, 3], NumberOfFrames=3)
    refused(tmp_path, "it announces 3 frames but describes 4")
    change(tmp_path / "a.dcm", PerFrameFunctionalGroupsSequence=None)
    refused(tmp_path, "it has 3 frames but lacks PerFrameFunctionalGroupsSequence")
    write_multiframe(tmp_path / "a.dcm", pixels, [0, 1, 1, 3])
    refused(tmp_path, "lie where another one lies (z = -37.50: a.dcm frame 2 and a.dcm frame 3)")
    write_multiframe(tmp_path / "a.dcm", pixels, [0, 1, 3])
    refused(tmp_path, "a slice is missing between z = -37.50 and z = -32.50")


@pytest.mark.filterwarnings("ignore:Invalid value for VR")
def test_a_dicomdir_is_never_followed(tmp_path):
    secret = tmp_path / "secret"
    write_series(secret, stored_values(3))
    folder = tmp_path / "folder"
    write_series(folder, stored_values(3))
    dataset = slice_dataset(stored_values(1)[0], (0, 0, 0), generate_uid(), Rows=None, Columns=None)
    dataset.file_meta.MediaStorageSOPClassUID = "1.2.840.10008.1.3.10"
    item = pydicom.Dataset()
    item.ReferencedFileID = ["..", "secret", "a00_3"]
    dataset.DirectoryRecordSequence = pydicom.Sequence([item])
    dataset.save_as(folder / "DICOMDIR")
    opened = []
    original = pydicom.dcmread

    def watched(path, *args, **keywords):
        opened.append(path)
        return original(path, *args, **keywords)

    pydicom.dcmread = watched
    try:
        assert read_volume(folder).grid.shape[2] == 3
    finally:
        pydicom.dcmread = original
    assert opened
    assert all(path.parent == folder for path in opened)


def test_no_pixel_file_is_read_twice_in_vain(tmp_path):
    """A folder of many files that are no DICOM is passed over quickly."""
    for number in range(300):
        (tmp_path / f"{number}.txt").write_bytes(b"x" * 5000)
    start = time.perf_counter()
    refused(tmp_path, "no DICOM images")
    assert time.perf_counter() - start < 2.0


def test_masks_of_a_label_scheme(tmp_path):
    write_series(tmp_path / "liver", np.zeros((3, 40, 36), np.uint8))
    # An empty mask is a label map without labels.
    assert not read_labels(tmp_path / "liver").voxels.any()
    (tmp_path / "liver" / "extra").mkdir()
    (tmp_path / "broken").mkdir()
    write_series(tmp_path / "broken", np.zeros((1, 40, 36), np.uint8))
    refused(tmp_path, "needs at least two slices", read_label_maps)


@pytest.mark.parametrize("syntax", [None, JPEG2000Lossless, RLELossless])
def test_truncations_and_flipped_bits(tmp_path, syntax):
    """Whatever happens to a file of a series, either an image comes out or one sentence."""
    paths = write_series(tmp_path, stored_values(3))
    if syntax:
        for path in paths:
            recompress(path, syntax)
    good = paths[1].read_bytes()
    rng = np.random.default_rng(5)
    sentences = []
    for trial in range(90):
        content = bytearray(good)
        if trial % 3 == 0:
            content = content[: int(rng.integers(len(content)))]
        else:
            reach = 1100 if syntax is None else len(content)
            for place in rng.integers(128, reach, int(rng.integers(1, 5))):
                content[place] = (
                    int(rng.integers(256)) if trial % 3 == 1 else content[place] ^ (1 << int(rng.integers(8)))
                )
        paths[1].write_bytes(content)
        try:
            read_volume(tmp_path)
        except BadInput as error:
            sentences.append(str(error))
    assert len(sentences) > 20
    assert not any("\n" in sentence for sentence in sentences)
