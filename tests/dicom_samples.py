"""Small DICOM series with known geometry and values, for the tests of the DICOM reader."""

from pathlib import Path
from typing import Any

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import (
    CTImageStorage,
    DeflatedExplicitVRLittleEndian,
    EnhancedCTImageStorage,
    ExplicitVRLittleEndian,
    generate_uid,
)

AXIAL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)


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


def recompress(path: Path, syntax: str) -> None:
    """Compress the pixels of a file, or the whole of it for the deflated syntax."""
    dataset = pydicom.dcmread(path)
    if syntax == DeflatedExplicitVRLittleEndian:
        dataset.file_meta.TransferSyntaxUID = syntax
        dataset.save_as(path)
    else:
        dataset.compress(syntax)
        dataset.save_as(path)


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
    shared.PlaneOrientationSequence = _item(ImageOrientationPatient=list(AXIAL))
    shared.PixelMeasuresSequence = _item(PixelSpacing=[0.8, 0.7], SliceThickness=step)
    dataset.SharedFunctionalGroupsSequence = Sequence([shared])
    frames = []
    for number in order:
        group = Dataset()
        group.PlanePositionSequence = _item(ImagePositionPatient=[-30.0, 20.0, -40.0 + step * number])
        group.PixelValueTransformationSequence = _item(RescaleSlope=2, RescaleIntercept=-1024 - number)
        frames.append(group)
    dataset.PerFrameFunctionalGroupsSequence = Sequence(frames)
    for keyword, value in tags.items():
        setattr(dataset, keyword, value)
    dataset.PixelData = stacked.tobytes()
    dataset.save_as(path)


def _item(**tags: Any) -> Sequence:
    item = Dataset()
    for keyword, value in tags.items():
        setattr(item, keyword, value)
    return Sequence([item])
