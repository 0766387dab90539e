"""Scans and label maps from files and back, in patient LPS mm."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from glisson.core import BadInput, LabelMap, Volume
from glisson.io.decoding import decoding
from glisson.io.dicom import has_dicom, read_dicom_folder, read_dicom_mask
from glisson.io.ircad import read_mask_folders
from glisson.io.label_names import canonical_name, canonical_table
from glisson.io.nifti import read_nifti, write_nifti
from glisson.io.nrrd_files import read_nrrd, write_nrrd
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
    """Read one label map, its names made canonical (see `label_names`).

    Names come from `names`, else from the scheme's table, else from the file; a mask with a single label
    and no name is called after its file ("liver.nii.gz" is "liver").

    Args:
        path: a NIfTI or NRRD file, or a folder with one DICOM mask.
        scheme: "totalsegmentator" (117 classes, version 2), "ircad" (a mask folder), or None.
        names: names by label number.

    Raises:
        BadInput: damaged, no whole numbers, or a label without a name.
    """
    source = Path(path)
    if scheme is not None and scheme not in SCHEMES:
        raise BadInput(f"Unknown label scheme {scheme!r}; use one of {list(SCHEMES)}.")
    image = read_dicom_mask(source) if source.is_dir() else _stored(source)
    with decoding(source, "a label map"):
        voxels = as_whole_numbers(image.voxels)
        return LabelMap(voxels, image.grid, _label_names(source, image, voxels, scheme, names))


def read_label_maps(
    path: str | Path, scheme: str | None = None, names: Mapping[int, str] | None = None
) -> tuple[LabelMap, ...]:
    """Read whatever holds labels: one file, one mask folder, or a folder of such files or folders (one map each).

    Arguments as for `read_labels`.

    Raises:
        BadInput: as for `read_labels`.
    """
    source = Path(path)
    if source.is_dir() and not has_dicom(source):
        visible = [file for file in sorted(source.iterdir()) if not file.name.startswith(".")]
        files = [file for file in visible if file.name.lower().endswith(_IMAGES)]
        return tuple(read_labels(file, scheme, names) for file in files) or read_mask_folders(source)
    return (read_labels(source, scheme, names),)


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
