"""Scans and label maps from files and back, in patient LPS mm."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core import BadInput, LabelMap, Volume
from glisson.io.decoding import decoding
from glisson.io.dicom import first_image, read_dicom_folder, read_dicom_mask
from glisson.io.dicom_segmentation import is_dicom_segmentation, read_dicom_segmentation, write_dicom_segmentation
from glisson.io.ircad import read_mask_folders
from glisson.io.label_names import canonical_name, canonical_table
from glisson.io.nifti import read_nifti, write_nifti
from glisson.io.nrrd_files import read_nrrd, write_nrrd
from glisson.io.slicer_segmentation import has_segments, read_segmentation, write_segmentation
from glisson.io.stored_image import StoredImage, as_whole_numbers
from glisson.io.totalsegmentator import class_names

_ARCHIVES = (".zip", ".tar", ".tgz", ".txz", ".tar.gz", ".tar.xz", ".tar.bz2", ".7z", ".rar")
_IMAGES = (".nii", ".nii.gz", ".nrrd", ".nhdr")
SCHEMES = ("totalsegmentator", "ircad")
"""How other tools number or name their labels."""


def read_volume(path: str | Path, series_uid: str | None = None) -> Volume:
    """Read a scan: a DICOM folder, `.nii`, `.nii.gz`, `.nrrd` or `.nhdr`.

    CT voxels are HU. NIfTI and NRRD do not say what made them: such a scan counts as CT unless Glisson
    wrote it as MR.

    Args:
        path: file or folder.
        series_uid: which series of a DICOM folder, where it holds several.

    Raises:
        BadInput: absent, damaged, too large, not 3-D, or of unclear geometry.
    """
    source = Path(path)
    image = read_dicom_folder(source, series_uid) if source.is_dir() else _stored(source)
    with decoding(source, "an image"):
        return Volume(image.voxels, image.grid, image.modality or "CT")


def write_volume(path: str | Path, volume: Volume) -> None:
    """Write a scan as `.nii`, `.nii.gz` or `.nrrd`; atomic.

    Raises:
        BadInput: the suffix is none of these, or the place cannot be written.
        WriteFailed: the disk is full.
    """
    target = Path(path)
    _writer(target)(target, volume.voxels, volume.grid, None, volume.modality)


def read_labels(path: str | Path, scheme: str | None = None, names: Mapping[int, str] | None = None) -> LabelMap:
    """Read one label map, its names made canonical (see `label_names`); arguments as for `read_label_maps`.

    Raises:
        BadInput: as for `read_label_maps`, or the labels overlap, so that they are several maps.
    """
    maps = read_label_maps(path, scheme, names)
    if len(maps) != 1:
        raise BadInput(f"{path} holds {len(maps)} label maps that may overlap; give one of them.")
    return maps[0]


def read_label_maps(
    path: str | Path, scheme: str | None = None, names: Mapping[int, str] | None = None
) -> tuple[LabelMap, ...]:
    """Read whatever holds labels, their names made canonical (see `label_names`).

    That is a NIfTI or NRRD file, a segmentation of 3D Slicer (`.seg.nrrd`) or DICOM (a map for each layer of
    segments that overlap), a folder with one DICOM mask, or a folder of such files or folders. Segmentations state
    names. Those of other files come from `names`, else from the scheme's table, else from the file; a mask with a
    single label and no name is called after its file ("liver.nii.gz" is "liver").

    Args:
        path: file or folder.
        scheme: "totalsegmentator" (117 classes, version 2), "ircad" (mask folders), or None.
        names: names by label number.

    Raises:
        BadInput: damaged, no whole numbers, or a label without a name.
    """
    source = Path(path)
    if scheme is not None and scheme not in SCHEMES:
        raise BadInput(f"Unknown label scheme {scheme!r}; use one of {list(SCHEMES)}.")
    if not source.is_dir():
        return _maps_of_file(source, scheme, names)
    first = first_image(source)
    if first is not None and not is_dicom_segmentation(first):
        return (_named_labels(source, read_dicom_mask(source), scheme, names),)
    visible = [file for file in sorted(source.iterdir()) if not file.name.startswith(".")]
    found = [file for file in visible if file.name.lower().endswith(_IMAGES) or is_dicom_segmentation(file)]
    return tuple(labels for file in found for labels in _maps_of_file(file, scheme, names)) or read_mask_folders(source)


def _maps_of_file(path: Path, scheme: str | None, names: Mapping[int, str] | None) -> tuple[LabelMap, ...]:
    if is_dicom_segmentation(path):
        return read_dicom_segmentation(path)
    if path.name.lower().endswith(_IMAGES[2:]) and has_segments(path):
        return read_segmentation(path)
    return (_named_labels(path, _stored(path), scheme, names),)


def _named_labels(path: Path, image: StoredImage, scheme: str | None, names: Mapping[int, str] | None) -> LabelMap:
    with decoding(path, "a label map"):
        voxels = as_whole_numbers(image.voxels)
        return LabelMap(voxels, image.grid, _label_names(path, image, voxels, scheme, names))


def write_segments(
    path: str | Path, maps: Sequence[LabelMap], scan: str | Path | None = None, series_uid: str | None = None
) -> None:
    """Write label maps that may overlap as one segmentation for other programs: `.seg.nrrd` or DICOM (`.dcm`); atomic.

    Args:
        path: the file to make.
        maps: label maps on one grid.
        scan: the DICOM folder of the scan, which a DICOM segmentation refers to.
        series_uid: which series, where that folder holds several.

    Raises:
        BadInput: the suffix is none of these, the scan is missing or another one, or the place cannot be written.
        WriteFailed: the disk is full.
    """
    target = Path(path)
    if target.name.lower().endswith(".seg.nrrd"):
        write_segmentation(target, maps)
    elif target.name.lower().endswith(".dcm"):
        if scan is None:
            raise BadInput(f"{path}: a DICOM segmentation refers to the images of its scan; give their DICOM folder.")
        write_dicom_segmentation(target, maps, Path(scan), series_uid)
    else:
        raise BadInput(f"{path}: segmentations are written as .seg.nrrd or .dcm.")


def write_labels(path: str | Path, labels: LabelMap) -> None:
    """Write a label map with its names inside the file, as `.nii`, `.nii.gz` or `.nrrd`; atomic.

    Raises:
        BadInput: the suffix is none of these, or the place cannot be written.
        WriteFailed: the disk is full.
    """
    target = Path(path)
    _writer(target)(target, as_whole_numbers(labels.voxels), labels.grid, labels.names, "")


def _stored(path: Path) -> StoredImage:
    name = path.name.lower()
    if not path.exists():
        raise BadInput(f"{path} does not exist.")
    if name.endswith(_IMAGES[:2]):
        return read_nifti(path)
    if name.endswith(_IMAGES[2:]):
        return read_nrrd(path)
    if name.endswith(_ARCHIVES):
        raise BadInput(f"{path} is an archive; unpack it first and give the folder.")
    raise BadInput(f"{path} is not an image that Glisson reads (a DICOM folder, .nii, .nii.gz, .nrrd or .nhdr).")


def _writer(path: Path) -> Callable[..., None]:
    name = path.name.lower()
    if name.endswith((".nii", ".nii.gz")):
        return write_nifti
    if name.endswith(".nrrd"):
        return write_nrrd
    raise BadInput(f"{path}: images are written as .nii, .nii.gz or .nrrd.")


def _label_names(
    path: Path, image: StoredImage, voxels: Any, scheme: str | None, names: Mapping[int, str] | None
) -> dict[int, str]:
    present = [int(number) for number in np.unique(voxels) if number != 0]
    if names is not None:
        table = dict(names)
    elif scheme == "totalsegmentator":
        table = canonical_table({number: name for number, name in class_names().items() if number in present})
    elif image.names:
        table = canonical_table(image.names)
    elif len(present) <= 1:
        table = {number: canonical_name(_stem(path)) for number in present}
    else:
        table = {}
    unnamed = [number for number in present if number not in table]
    if unnamed:
        listed = ", ".join(map(str, unnamed[:8])) + (" …" if len(unnamed) > 8 else "")
        raise BadInput(
            f"its labels {listed} have no name; give the names, or the scheme that numbers them ({', '.join(SCHEMES)})."
        )
    return table


def _stem(path: Path) -> str:
    name = path.name
    for suffix in (".gz", ".nii", ".nrrd", ".nhdr"):
        if name.lower().endswith(suffix):
            name = name[: -len(suffix)]
    return name
