"""Small DICOM series with known geometry and values, for the tests of the DICOM reader."""

from base64 import b64decode
from collections.abc import Sequence as Frames
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
import pytest
from pydicom.data import get_testdata_file
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.encaps import encapsulate, generate_frames
from pydicom.sequence import Sequence
from pydicom.uid import (
    CTImageStorage,
    DeflatedExplicitVRLittleEndian,
    EnhancedCTImageStorage,
    ExplicitVRLittleEndian,
    JPEGLossless,
    JPEGLosslessSV1,
    generate_uid,
)

needs_jpeg_ls = pytest.mark.skipif(find_spec("jpeg_ls") is None, reason="pyjpegls has no wheel for this Python")

AXIAL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)

# Rows r and columns c of (7 r² + 31 c + 900 if r + c is a multiple of 7) modulo 4096, as GDCM 3.2.6 codes them.
GDCM_LOSSLESS = b64decode(
    "/9j/wwALEAAQABQBAREA/8QAGgABAQADAQEAAAAAAAAAAAAABQoGBwgLD//aAAgBAQABAAD4HBxNPvvvv3RxNPvvvv3RxNPvvvxBPvvvv3Rx"
    "NPvvvv3RxNPvvvvqvvvv3RxNPvvvv3RxNPvvvv3R5G++/dHE0++++/dHE0++++/dHE1mL790cTT777790cTT777790cTT+fv3RxNPvvvv3Rx"
    "NPvvvv3RxNPv7Nujiafffffujiafffffujiafffvfiafffffujiafffffujiaffffjkfffffujiafffffujiafffff3u+++/dHE0++++/dHE"
    "0++++/dH0K++/dHE0++++/dHE0++++/dHE10m+/dHE0++++/dHE0++++/dHE0/1C/dHE0++++/dHE0++++/dHE0+/wBX3RxNPvvvv3RxNPvv"
    "vv3RxNPvv+iDE0++++/dHE0++++/dHE0+++/KM++++/dHE0++++/dHE0++++/wD/2QA="
)


def stored_values(slices: int = 6, rows: int = 40, columns: int = 36) -> np.ndarray:
    """Stored pixels (slices, rows, columns), 12 bits, different everywhere that matters."""
    return np.random.default_rng(7).integers(0, 4096, (slices, rows, columns)).astype(np.uint16)


def slice_dataset(pixels: np.ndarray, position: Any, series: str, **tags: Any) -> FileDataset:
    """One CT slice of stored values (rows, columns) at an LPS position; a tag set to None is left out."""
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID = CTImageStorage
    meta.MediaStorageSOPInstanceUID = generate_uid()
    meta.TransferSyntaxUID = ExplicitVRLittleEndian
    dataset = FileDataset("", {}, file_meta=meta, preamble=b"\0" * 128)
    values = {
        "SOPClassUID": CTImageStorage,
        "SOPInstanceUID": meta.MediaStorageSOPInstanceUID,
        "Modality": "CT",
        "SeriesInstanceUID": series,
        "SeriesDescription": "portal venous",
        "ImagePositionPatient": [float(x) for x in position],
        "ImageOrientationPatient": list(AXIAL),
        "PixelSpacing": [0.8, 0.7],
        "Rows": pixels.shape[0],
        "Columns": pixels.shape[1],
        "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2",
        "BitsAllocated": pixels.dtype.itemsize * 8,
        "BitsStored": 12 if pixels.dtype.itemsize == 2 else 8,
        "HighBit": 11 if pixels.dtype.itemsize == 2 else 7,
        "PixelRepresentation": 0,
        "RescaleSlope": 1,
        "RescaleIntercept": -1024,
        "InstanceNumber": 1,
    } | tags
    for keyword, value in values.items():
        if value is not None:
            setattr(dataset, keyword, value)
    dataset.PixelData = pixels.tobytes()
    dataset["PixelData"].VR = "OW" if pixels.dtype.itemsize == 2 else "OB"
    return dataset


def write_series(
    folder: Path, pixels: np.ndarray, step: float = 2.5, z0: float = -40.0, prefix: str = "a", **tags: Any
) -> list[Path]:
    """Single-frame series with names and instance numbers that contradict the geometry."""
    folder.mkdir(parents=True, exist_ok=True)
    series = tags.pop("SeriesInstanceUID", None) or generate_uid()
    paths = []
    for number, frame in enumerate(pixels):
        instance = len(pixels) - number
        dataset = slice_dataset(
            frame, (-30.0, 20.0, z0 + step * number), series, **({"InstanceNumber": instance} | tags)
        )
        path = folder / f"{prefix}{(number * 5) % 17:02d}_{instance}"
        dataset.save_as(path)
        paths.append(path)
    return paths


def change(path: Path, **tags: Any) -> None:
    """Set tags of a file; None deletes."""
    dataset = pydicom.dcmread(path)
    for keyword, value in tags.items():
        if value is None:
            delattr(dataset, keyword)
        else:
            setattr(dataset, keyword, value)
    dataset.save_as(path)


def recompress(path: Path, syntax: str, **options: Any) -> None:
    """Compress the pixels of a file, or the whole of it for the deflated syntax."""
    dataset = pydicom.dcmread(path)
    if syntax == DeflatedExplicitVRLittleEndian:
        dataset.file_meta.TransferSyntaxUID = syntax
        dataset.save_as(path)
    elif syntax in (JPEGLossless, JPEGLosslessSV1):
        pixels = dataset.pixel_array.reshape(-1, dataset.Rows, dataset.Columns)
        predictor = 1 if syntax == JPEGLosslessSV1 else 6
        set_frames(path, [jpeg_lossless(frame, dataset.BitsStored, predictor) for frame in pixels], syntax)
    else:
        dataset.compress(syntax, **options)
        dataset.save_as(path)


def frames_of(path: Path) -> list[bytes]:
    """The compressed frames of a file."""
    dataset = pydicom.dcmread(path)
    return list(generate_frames(dataset.PixelData, number_of_frames=int(dataset.get("NumberOfFrames", 1))))


def set_frames(path: Path, frames: Frames[bytes], syntax: str | None = None, fragments: int = 1) -> None:
    """Put compressed frames in place of a file's pixels, each in so many fragments."""
    dataset = pydicom.dcmread(path)
    dataset.file_meta.TransferSyntaxUID = syntax or dataset.file_meta.TransferSyntaxUID
    dataset.PixelData = encapsulate(list(frames), fragments_per_frame=fragments)
    dataset["PixelData"].VR = "OB"
    dataset["PixelData"].is_undefined_length = True
    dataset.save_as(path)


def jpeg_lossless(pixels: np.ndarray, precision: int, predictor: int = 1, restart_lines: int = 0) -> bytes:
    """JPEG Lossless frame (T.81 annex H): sizes 0 to 6 have codes of three bits, a greater size one bit more each."""
    rows, columns = pixels.shape
    values = np.pad(pixels.astype(np.int64) & ((1 << precision) - 1), ((1, 0), (1, 0)))
    left, above, corner = values[1:, :-1], values[:-1, 1:], values[:-1, :-1]
    predictions = (
        left,
        above,
        corner,
        left + above - corner,
        left + ((above - corner) >> 1),
        above + ((left - corner) >> 1),
        (left + above) >> 1,
    )[predictor - 1].copy()
    predictions[:, 0] = above[:, 0]
    for line in range(0, rows, restart_lines or rows):
        predictions[line] = left[line]
        predictions[line, 0] = 1 << (precision - 1)
    differences = (values[1:, 1:] - predictions + 32767) % 65536 - 32767
    coded = b""
    for number, line in enumerate(range(0, rows, restart_lines or rows)):
        coded += bytes([0xFF, 0xD0 + (number - 1) % 8]) if number else b""
        coded += _coded(differences[line : line + (restart_lines or rows)].ravel().tolist())
    frame = bytes([precision]) + rows.to_bytes(2) + columns.to_bytes(2) + b"\1\1\x11\0"
    header = _segment(0xC3, frame) + _segment(0xC4, bytes([0, 0, 0, 7, *[1] * 10, 0, 0, 0, *range(17)]))
    header += _segment(0xDD, (restart_lines * columns).to_bytes(2))
    return b"\xff\xd8" + header + _segment(0xDA, bytes([1, 1, 0, predictor, 0, 0])) + coded + b"\xff\xd9"


def _coded(differences: list[int]) -> bytes:
    bits = ""
    for difference in differences:
        size = abs(difference).bit_length()
        bits += f"{size:03b}" if size < 7 else "1" * (size - 4) + "0"
        if 0 < size < 16:
            bits += f"{difference if difference > 0 else difference + (1 << size) - 1:0{size}b}"
    bits += "1" * (-len(bits) % 8)
    return int(bits, 2).to_bytes(len(bits) // 8).replace(b"\xff", b"\xff\0")


def _segment(marker: int, content: bytes) -> bytes:
    return bytes([0xFF, marker]) + (len(content) + 2).to_bytes(2) + content


def jpeg_extended() -> bytes:
    """A frame of 256 × 1024 pixels of 12 bits in JPEG Extended, which comes with pydicom."""
    return frames_of(Path(get_testdata_file("JPEG-lossy.dcm", download=False)))[0]


def strip_preamble(path: Path) -> None:
    """Leave the data set alone: implicit little endian, no preamble, no meta information."""
    dataset = pydicom.dcmread(path)
    bare = Dataset()
    bare.update({element.tag: element for element in dataset})
    pydicom.dcmwrite(path, bare, implicit_vr=True, little_endian=True, enforce_file_format=False)


def write_multiframe(path: Path, pixels: np.ndarray, order: list[int], step: float = 2.5, **tags: Any) -> None:
    """Enhanced CT whose frame n is slice `order[n]`; geometry partly shared, partly for each frame."""
    path.parent.mkdir(parents=True, exist_ok=True)
    stacked = pixels[order]
    dataset = slice_dataset(pixels[0], (0, 0, 0), generate_uid())
    for keyword in (
        "ImagePositionPatient",
        "ImageOrientationPatient",
        "PixelSpacing",
        "RescaleSlope",
        "RescaleIntercept",
    ):
        delattr(dataset, keyword)
    dataset.SOPClassUID = EnhancedCTImageStorage
    dataset.file_meta.MediaStorageSOPClassUID = EnhancedCTImageStorage
    dataset.NumberOfFrames = len(order)
    shared = Dataset()
    shared.PlaneOrientationSequence = item(ImageOrientationPatient=list(AXIAL))
    shared.PixelMeasuresSequence = item(PixelSpacing=[0.8, 0.7], SliceThickness=step)
    dataset.SharedFunctionalGroupsSequence = Sequence([shared])
    frames = []
    for number in order:
        group = Dataset()
        group.PlanePositionSequence = item(ImagePositionPatient=[-30.0, 20.0, -40.0 + step * number])
        group.PixelValueTransformationSequence = item(RescaleSlope=2, RescaleIntercept=-1024 - number)
        frames.append(group)
    dataset.PerFrameFunctionalGroupsSequence = Sequence(frames)
    for keyword, value in tags.items():
        setattr(dataset, keyword, value)
    dataset.PixelData = stacked.tobytes()
    dataset.save_as(path)


def item(**tags: Any) -> Sequence:
    """A sequence with one item of these tags."""
    group = Dataset()
    for keyword, value in tags.items():
        setattr(group, keyword, value)
    return Sequence([group])
