"""DICOM segmentations (PS3.3, A.51) as label maps and back; highdicom knows the frames and the bits.

Frames without a voxel are mostly left out of such a file: the grid is made anew from where the others lie, and
reaches from the first of them to the last.
"""

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pydicom
from numpy.typing import NDArray
from pydicom.uid import SegmentationStorage, generate_uid

import glisson
from glisson.core import BadInput, Grid, LabelMap
from glisson.io.atomic import atomic_path
from glisson.io.confidentiality_profile import apply_profile
from glisson.io.decoding import check_image_size, decoding
from glisson.io.dicom import quiet, series_slices
from glisson.io.dicom_headers import Slice, read_header
from glisson.io.label_groups import on_grid_of
from glisson.io.label_names import canonical_name, canonical_names, is_canonical
from glisson.io.stored_image import in_c_order
from glisson.io.structure_codes import CODES, StructureCode, category_and_type

_NEEDED = ("StudyInstanceUID", "SeriesInstanceUID", "SOPClassUID", "SOPInstanceUID", "FrameOfReferenceUID")
_MAY_BE_EMPTY = (
    *("PatientID", "PatientName", "PatientBirthDate", "PatientSex", "ReferringPhysicianName"),
    *("AccessionNumber", "StudyID", "StudyDate", "StudyTime", "PositionReferenceIndicator"),
)
_ALGORITHM = StructureCode("123111", "DCM", "Deformable Models")
_LABEL_MAP_STORAGE = "1.2.840.10008.5.1.4.1.1.66.7"  # younger than pydicom's table
SEGMENTATION_STORAGES = (SegmentationStorage, _LABEL_MAP_STORAGE)
"""SOP classes of segmentations."""


def is_dicom_segmentation(path: Path) -> bool:
    """Whether a file is a DICOM segmentation."""
    with quiet():
        header = read_header(path) if path.is_file() else None
    return header is not None and header.get("SOPClassUID") in SEGMENTATION_STORAGES


def read_dicom_segmentation(path: Path) -> tuple[LabelMap, ...]:
    """The segments of a file that `is_dicom_segmentation`, names made canonical, in as few maps as overlaps allow.

    A segment is called by its label, or by its code where the label says nothing that Glisson knows. Of fractional
    segments the voxels of a half and more count.

    Raises:
        BadInput: damaged, too large, or without a regular grid.
    """
    with decoding(path, "a DICOM segmentation"), quiet():
        segmentation = _highdicom().seg.segread(path, lazy_frame_retrieval=True)
        grid = _grid(segmentation)
        numbers = list(segmentation.segment_numbers)
        names = canonical_names(_name(segmentation.get_segment_description(number)) for number in numbers)
        layers: list[tuple[NDArray[np.uint8], dict[int, str]]] = []
        for number, name in zip(numbers, names, strict=True):
            volume = segmentation.get_volume(segment_numbers=[number], combine_segments=False)
            _into_layer(layers, in_c_order(volume.array[..., 0].T >= 0.5), name)
        return tuple(LabelMap(voxels, grid, table) for voxels, table in layers)


def write_dicom_segmentation(path: Path, maps: Sequence[LabelMap], scan: Path, series_uid: str | None = None) -> None:
    """Write label maps as one binary DICOM segmentation of the series that they were made of; atomic.

    Patient and study are those of the series, since a segmentation belongs into the same record; where the patient's
    identity was removed from the series, the segmentation tells no more than that. Frames without a voxel are left out.

    Args:
        path: the file to make.
        maps: label maps on the grid of the scan, whatever the order and sense of its axes; they may overlap.
        scan: the DICOM folder of the scan.
        series_uid: which series, where the folder holds several.

    Raises:
        BadInput: no label, not the scan of these labels, or the place cannot be written.
        WriteFailed: the disk is full.
    """
    with decoding(scan, "a DICOM folder"), quiet():
        slices, grid = series_slices(scan, series_uid)
        placed = [on_grid_of(grid, labels, "the segmentation") for labels in maps]
        named = [(labels.mask(name), name) for labels in placed for name in labels.names.values()]
        named = [(mask, name) for mask, name in named if mask.any()]
        if not named:
            raise BadInput("there is no label to write.")
        frames = np.flatnonzero(np.logical_or.reduce([mask.any(axis=(0, 1)) for mask, _ in named]))
        first, last = int(frames[0]), int(frames[-1]) + 1
        pixels = np.stack([mask[:, :, first:last].T for mask, _ in named], axis=-1)
        made = _segmentation(
            _sources(slices[first:last], float(grid.spacing_mm[2])), pixels, [name for _, name in named]
        )
        if made.get("PatientIdentityRemoved") == "YES":
            apply_profile(made)
            made.file_meta.MediaStorageSOPInstanceUID = made.SOPInstanceUID
    with atomic_path(path) as temporary:
        made.save_as(temporary)


def _grid(segmentation: Any) -> Grid:
    geometry = None if segmentation.is_tiled else segmentation.get_volume_geometry()
    if geometry is None:
        raise BadInput("its frames do not lie on one regular grid.")
    frames, rows, columns = geometry.spatial_shape
    check_image_size((columns, rows, frames), 4)
    # The axes of highdicom are (frame, row, column), ours (column, row, frame).
    spacing, direction = np.array(geometry.spacing)[::-1], np.asarray(geometry.direction)[:, ::-1]
    return Grid((columns, rows, frames), spacing, np.array(geometry.position), direction)


def _name(segment: Any) -> str:
    label = str(segment.segment_label)
    if is_canonical(canonical_name(label)):
        return label
    code = segment.segmented_property_type  # equal to its like in SNOMED's older scheme, too
    return next((name for name, known in CODES.items() if code == _coded(known)), label)


def _into_layer(layers: list[tuple[NDArray[np.uint8], dict[int, str]]], mask: NDArray[np.bool_], name: str) -> None:
    """Put a mask into the first layer that is free where it lies."""
    for voxels, table in layers:
        if len(table) < np.iinfo(np.uint8).max and not voxels[mask].any():
            table[len(table) + 1] = name
            voxels[mask] = len(table)
            return
    layers.append((mask.astype(np.uint8), {1: name}))


def _sources(slices: Sequence[Slice], step_mm: float) -> list[Any]:
    """Headers of the images that the slices come from, in their order, with what is often missing filled in."""
    paths = list(dict.fromkeys(one.path for one in slices))
    if len(paths) < len(slices):
        raise BadInput("it holds multi-frame images; a segmentation is written for series of single images only.")
    sources = [pydicom.dcmread(path, stop_before_pixels=True, force=True) for path in paths]
    for source in sources:
        missing = [keyword for keyword in _NEEDED if not source.get(keyword)]
        if missing:
            raise BadInput(f"its images lack {' and '.join(missing)}, to which a segmentation must refer.")
        for keyword in _MAY_BE_EMPTY:
            if keyword not in source:
                setattr(source, keyword, "")
        source.SliceThickness = source.get("SliceThickness") or step_mm
    return sources


def _highdicom() -> Any:
    if find_spec("highdicom") is None:
        raise BadInput("DICOM segmentations need the package highdicom, which is not installed; use .seg.nrrd.")
    import highdicom  # slow to load, and the package has no wheels for the latest Pythons
    import highdicom.seg
    import highdicom.sr

    return highdicom


def _coded(code: StructureCode) -> Any:
    return _highdicom().sr.CodedConcept(code.value, code.scheme, code.meaning)


def _segmentation(sources: Sequence[Any], pixels: NDArray[np.bool_], names: Sequence[str]) -> Any:
    highdicom = _highdicom()
    algorithm = highdicom.AlgorithmIdentificationSequence(
        name="Glisson", version=glisson.__version__, family=_coded(_ALGORITHM)
    )
    descriptions = [
        highdicom.seg.SegmentDescription(
            segment_number=number,
            segment_label=name,
            segmented_property_category=_coded(category_and_type(name)[0]),
            segmented_property_type=_coded(category_and_type(name)[1]),
            algorithm_type="SEMIAUTOMATIC",
            algorithm_identification=algorithm,
        )
        for number, name in enumerate(names, start=1)
    ]
    return highdicom.seg.Segmentation(
        source_images=sources,
        pixel_array=pixels,
        segmentation_type=highdicom.seg.SegmentationTypeValues.BINARY,
        segment_descriptions=descriptions,
        series_instance_uid=generate_uid(),
        series_number=1000,
        sop_instance_uid=generate_uid(),
        instance_number=1,
        manufacturer="Glisson",
        manufacturer_model_name="Glisson",
        software_versions=glisson.__version__,
        device_serial_number="0",
        series_description="Segmentation",
    )
