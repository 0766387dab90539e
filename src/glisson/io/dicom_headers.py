"""The headers of the DICOM files in a folder, one `Slice` a frame; no pixel is read here.

Reference: DICOM PS3.3 (image plane, functional groups, modality LUT) and PS3.10 (file format). Single-frame
images carry geometry at their top level, multi-frame ones in shared and per-frame functional groups.
References to other files (DICOMDIR) are never followed.
"""

import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pydicom
from pydicom.datadict import tag_for_keyword
from pydicom.dataset import Dataset
from pydicom.uid import DeflatedExplicitVRLittleEndian, RLELossless

from glisson.core import BadInput
from glisson.core.arrays import FloatArray
from glisson.io.decoding import MAX_IMAGE_BYTES, check_image_size, decoding

_DESCRIBING = [
    "BitsAllocated",
    "BitsStored",
    "BurnedInAnnotation",
    "Columns",
    "ImageOrientationPatient",
    "ImagePositionPatient",
    "Modality",
    "NumberOfFrames",
    "PerFrameFunctionalGroupsSequence",
    "PhotometricInterpretation",
    "PixelRepresentation",
    "PixelSpacing",
    "RescaleIntercept",
    "RescaleSlope",
    "Rows",
    "SOPClassUID",
    "SamplesPerPixel",
    "SeriesDescription",
    "SeriesInstanceUID",
    "SharedFunctionalGroupsSequence",
]
_RLE_RATIO = 64
"""PackBits turns two bytes into at most 128."""

_CHUNK = 1 << 20
_LARGEST_META = 1 << 16


@dataclass(frozen=True, eq=False)
class Slice:
    """One frame: where it lies (LPS mm), how it is stored, and what its values mean.

    `row` is the direction of growing column index, `column` that of growing row index; `spacing_mm` is
    (between columns, between rows). `slope` and `intercept` are None where the file has none.
    """

    path: Path
    frame: int
    shape: tuple[int, int]
    position_mm: FloatArray
    row: FloatArray
    column: FloatArray
    spacing_mm: FloatArray
    slope: float | None
    intercept: float | None
    bits_stored: int
    is_signed: bool
    is_inverted: bool


@dataclass(frozen=True, eq=False)
class ImageFile:
    """One DICOM file that holds an image."""

    path: Path
    header: Any

    @property
    def series(self) -> str:
        """Series instance UID ("" in files that were stripped of it)."""
        return str(self.header.get("SeriesInstanceUID", "") or "")

    @property
    def modality(self) -> str:
        """Modality, for example "CT"."""
        return str(self.header.get("Modality", "") or "")

    @property
    def description(self) -> str:
        """What the scanner calls the series."""
        return str(self.header.get("SeriesDescription", "") or "")

    @property
    def has_burned_in_text(self) -> bool:
        """Whether the header says that text which tells who the patient is was drawn into the pixels."""
        return str(self.header.get("BurnedInAnnotation", "") or "").upper() == "YES"

    @property
    def frames(self) -> int:
        """Number of frames."""
        return int(self.header.get("NumberOfFrames", 1) or 1)


def image_files(folder: Path) -> Iterator[ImageFile]:
    """Headers of all images directly in a folder, by name; whatever is no DICOM image is passed over.

    Raises:
        BadInput: a DICOM file is damaged.
    """
    for path in sorted(folder.iterdir()):
        if path.name.startswith(".") or not path.is_file():
            continue
        header = read_header(path)
        if header is not None and "Rows" in header and "Columns" in header:
            yield ImageFile(path, header)


def read_header(path: Path) -> Any:
    """What a DICOM file says of itself, without pixels; None if it is no DICOM file.

    Files without the preamble are recognised by their first element's group.

    Raises:
        BadInput: it is DICOM and damaged, or unpacks to more than `MAX_IMAGE_BYTES`.
    """
    with path.open("rb") as file:
        start = file.read(132)
    if start[128:] != b"DICM" and start[:2] not in (b"\x08\x00", b"\x02\x00", b"\x00\x08"):
        return None
    with decoding(path, "a DICOM file"):
        _refuse_inflation(path)
        return pydicom.dcmread(path, stop_before_pixels=True, force=True, specific_tags=_DESCRIBING)


def slices_of(file: ImageFile, needs_rescale: bool) -> list[Slice]:
    """The frames of an image, with everything that its header says checked.

    Args:
        file: header of the image.
        needs_rescale: whether slope and intercept must be there (CT, whose values else are not HU).

    Raises:
        BadInput: tags missing (named), values unusable, or a size above the limits.
    """
    with decoding(file.path, "a DICOM image"):
        _check_size(file)
        groups = _functional_groups(file)
        return [_slice(file, number, group, needs_rescale) for number, group in enumerate(groups)]


def transfer_syntax(header: Any) -> str:
    """UID of the transfer syntax; for files without meta information that which was found on reading."""
    stated = header.file_meta.get("TransferSyntaxUID")
    if stated:
        return str(stated)
    implicit, little = header.original_encoding
    if implicit:
        return str(pydicom.uid.ImplicitVRLittleEndian)
    return str(pydicom.uid.ExplicitVRLittleEndian if little else pydicom.uid.ExplicitVRBigEndian)


def _refuse_inflation(path: Path) -> None:
    """Deflated files are unpacked whole by pydicom, so they are measured first."""
    with path.open("rb") as file:
        start = 132 if file.read(132)[128:] == b"DICM" else 0
        file.seek(start)
        meta = file.read(_LARGEST_META)
        if DeflatedExplicitVRLittleEndian.encode() not in meta:
            return
        file.seek(start + _end_of_meta(meta))
        if _unpacks_beyond(file, MAX_IMAGE_BYTES):
            raise BadInput(f"it unpacks to more than {MAX_IMAGE_BYTES / 1e9:.1f} GB.")


def _end_of_meta(block: bytes) -> int:
    """Where the elements of group 0002 end; they are explicit little endian, whatever follows them."""
    position = 0
    while block[position : position + 2] == b"\x02\0":
        is_long = block[position + 4 : position + 6] in (b"OB", b"UN")
        field = slice(position + 8, position + 12) if is_long else slice(position + 6, position + 8)
        position += (12 if is_long else 8) + int.from_bytes(block[field], "little")
    return position


def _unpacks_beyond(file: BinaryIO, limit: int) -> bool:
    decompressor = zlib.decompressobj(-zlib.MAX_WBITS)
    size = 0
    while chunk := decompressor.unconsumed_tail or file.read(_CHUNK):
        size += len(decompressor.decompress(chunk, _CHUNK))
        if size > limit:
            return True
    return False


def _check_size(file: ImageFile) -> None:
    header = file.header
    samples = int(header.get("SamplesPerPixel", 1) or 1)
    if samples != 1:
        raise BadInput("it is a colour image, no scan.")
    _require(header, ("BitsAllocated",), file.path)
    bits = int(header.BitsAllocated)
    if bits not in (1, 8, 16, 32):
        raise BadInput(f"its {bits} bits per pixel are not read.")
    rows, columns, frames = int(header.Rows), int(header.Columns), file.frames
    check_image_size((columns, rows, frames), max(bits // 8, 1))
    syntax = pydicom.uid.UID(transfer_syntax(header))
    packing = 1 if not syntax.is_encapsulated and not syntax.is_deflated else _RLE_RATIO if syntax == RLELossless else 0
    if packing and file.path.stat().st_size * packing < rows * columns * frames * bits // 8:
        raise BadInput(f"it is too short for the {columns} × {rows} × {frames} pixels that its header announces.")


def _functional_groups(file: ImageFile) -> list[list[Any]]:
    """For each frame the data sets to look into, the most specific first."""
    per_frame = file.header.get("PerFrameFunctionalGroupsSequence")
    shared = list(file.header.get("SharedFunctionalGroupsSequence") or [])[:1]
    if per_frame is None:
        if file.frames != 1:
            raise BadInput(f"it has {file.frames} frames but lacks PerFrameFunctionalGroupsSequence.")
        return [[*shared, file.header]]
    if len(per_frame) != file.frames:
        raise BadInput(f"it announces {file.frames} frames but describes {len(per_frame)}.")
    return [[group, *shared, file.header] for group in per_frame]


def _slice(file: ImageFile, number: int, groups: Sequence[Any], needs_rescale: bool) -> Slice:
    position = _find(groups, "PlanePositionSequence", "ImagePositionPatient")
    orientation = _find(groups, "PlaneOrientationSequence", "ImageOrientationPatient")
    spacing = _find(groups, "PixelMeasuresSequence", "PixelSpacing")
    slope = _find(groups, "PixelValueTransformationSequence", "RescaleSlope")
    intercept = _find(groups, "PixelValueTransformationSequence", "RescaleIntercept")
    found = {"ImagePositionPatient": position, "ImageOrientationPatient": orientation, "PixelSpacing": spacing}
    if needs_rescale:
        found |= {"RescaleSlope": slope, "RescaleIntercept": intercept}
    missing = [keyword for keyword, value in found.items() if value is None]
    if missing:
        raise BadInput(f"it lacks {' and '.join(_named(keyword) for keyword in missing)}, so it cannot be used.")
    axes = _numbers("ImageOrientationPatient", orientation, 6)
    between_rows, between_columns = _numbers("PixelSpacing", spacing, 2)
    if min(between_rows, between_columns) <= 0.0:
        raise BadInput(f"its PixelSpacing {between_rows} × {between_columns} mm is not positive.")
    bits = int(file.header.BitsAllocated)
    return Slice(
        path=file.path,
        frame=number,
        shape=(int(file.header.Columns), int(file.header.Rows)),
        position_mm=_numbers("ImagePositionPatient", position, 3),
        row=axes[:3],
        column=axes[3:],
        spacing_mm=np.array([between_columns, between_rows]),
        slope=None if slope is None else float(_numbers("RescaleSlope", slope, 1)[0]),
        intercept=None if intercept is None else float(_numbers("RescaleIntercept", intercept, 1)[0]),
        bits_stored=int(file.header.get("BitsStored", bits) or bits),
        is_signed=int(file.header.get("PixelRepresentation", 0) or 0) == 1,
        is_inverted=file.header.get("PhotometricInterpretation") == "MONOCHROME1",
    )


def _find(groups: Sequence[Any], sequence: str, keyword: str) -> Any:
    for group in groups:
        nested = group.get(sequence)
        for place in [*(list(nested)[:1] if nested else []), group]:
            value = place.get(keyword)
            if value is not None and value != "" and value != []:
                return value
    return None


def _numbers(keyword: str, value: Any, count: int) -> FloatArray:
    entries = list(value) if isinstance(value, (list, pydicom.multival.MultiValue)) else [value]
    numbers = np.array([float(entry) for entry in entries], dtype=np.float64)
    if numbers.shape != (count,) or not np.isfinite(numbers).all():
        raise BadInput(f"its {keyword} must be {count} finite numbers, not {value}.")
    return numbers


def _require(header: Dataset, keywords: Sequence[str], path: Path) -> None:
    missing = [keyword for keyword in keywords if header.get(keyword) in (None, "")]
    if missing:
        raise BadInput(f"it lacks {' and '.join(_named(keyword) for keyword in missing)}.")


def _named(keyword: str) -> str:
    tag = tag_for_keyword(keyword) or 0
    return f"{keyword} ({tag >> 16:04X},{tag & 0xFFFF:04X})"
