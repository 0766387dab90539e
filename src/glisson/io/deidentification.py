"""Copies of DICOM files that do not tell who the patient is: the basic profile of PS3.15, Annex E.

Files get new names, since names and folders often tell the patient's. The pixels are copied as they are stored; text
that was drawn into them stays.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import pydicom
from pydicom import uid as uids
from pydicom.dataset import FileMetaDataset

from glisson.core import BadInput
from glisson.core.protocols import Progress, silent
from glisson.io.atomic import atomic_folder
from glisson.io.confidentiality_profile import apply_profile
from glisson.io.decoding import decoding
from glisson.io.dicom import quiet
from glisson.io.dicom_headers import read_header, transfer_syntax
from glisson.io.dicom_segmentation import SEGMENTATION_STORAGES

_TAKEN = {
    uids.CTImageStorage,
    uids.EnhancedCTImageStorage,
    uids.LegacyConvertedEnhancedCTImageStorage,
    uids.MRImageStorage,
    uids.EnhancedMRImageStorage,
    uids.LegacyConvertedEnhancedMRImageStorage,
    *SEGMENTATION_STORAGES,
}
"""What is copied. Reports, structured or not, plans and screenshots are full of text that no table of tags knows."""


@dataclass(frozen=True)
class Deidentified:
    """The folders made, one for each series (the only one is `out` itself), and how many files came along or not."""

    folders: tuple[Path, ...]
    files: int
    left_out: int


def deidentify_folder(folder: str | Path, out: str | Path, progress: Progress = silent) -> Deidentified:
    """Copy CT, MR and segmentations, whatever the depth of their folders, without what tells who the patient is.

    UIDs are replaced by others that depend on nothing but them, so what belongs together still does, in later runs,
    too. Other files are left out. The copies appear all or none.

    Args:
        folder: where the DICOM files lie.
        out: the folder to make; it must not lie in `folder`.
        progress: told how far it is.

    Raises:
        BadInput: nothing to copy, a damaged file, or a place that exists already or cannot be written.
        WriteFailed: the disk is full.
    """
    source, target = Path(folder), Path(out)
    _check_places(source, target)
    with quiet():
        taken, left_out = _chosen(source)
        numbers = {series: number for number, series in enumerate(dict.fromkeys(taken.values()), start=1)}
        names = {series: f"series{number}" if len(numbers) > 1 else "" for series, number in numbers.items()}
        written: Counter[str] = Counter()
        with atomic_folder(target) as making:
            for path, series in taken.items():
                written[series] += 1
                place = making / names[series] / f"{written[series]:05d}.dcm"
                place.parent.mkdir(exist_ok=True)
                with decoding(path, "a DICOM file"):
                    _copy(path, place)
                progress(written.total() / len(taken), f"file {written.total()} of {len(taken)}")
    return Deidentified(tuple(target / name for name in names.values()), len(taken), left_out)


def _check_places(source: Path, target: Path) -> None:
    if not source.is_dir():
        raise BadInput(f"{source} is not a folder; give the folder with the DICOM files.")
    if target.resolve() == source.resolve() or source.resolve() in target.resolve().parents:
        raise BadInput(f"{target} lies in {source}, which stays as it is; choose a folder outside of it.")
    if target.exists() and (not target.is_dir() or any(target.iterdir())):
        raise BadInput(f"{target} exists already; choose another folder for the copies or remove it first.")


def _chosen(source: Path) -> tuple[dict[Path, str], int]:
    """The files to be copied with their series, and how many others there are."""
    files = [path for path in sorted(source.rglob("*")) if path.is_file()]
    headers = [(path, read_header(path)) for path in files]
    taken = {
        path: str(header.get("SeriesInstanceUID", "") or "")
        for path, header in headers
        if header is not None and header.get("SOPClassUID") in _TAKEN
    }
    if not taken:
        raise BadInput(f"{source} holds no CT, MR or segmentation of DICOM.")
    return taken, len(files) - len(taken)


def _copy(path: Path, place: Path) -> None:
    dataset = pydicom.dcmread(path, force=True)
    syntax = transfer_syntax(dataset)
    apply_profile(dataset)
    if not dataset.get("SOPInstanceUID"):
        raise BadInput("it lacks SOPInstanceUID (0008,0018), so it cannot be copied.")
    meta = FileMetaDataset()
    meta.TransferSyntaxUID = uids.UID(syntax)
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = dataset.SOPClassUID, dataset.SOPInstanceUID
    # Both may tell more: who sent the file, or a picture of another format in the first bytes.
    dataset.file_meta, dataset.preamble = meta, b"\0" * 128
    dataset.save_as(place, enforce_file_format=True)
