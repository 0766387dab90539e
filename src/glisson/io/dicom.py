"""A folder of DICOM files as one image: choose the series, check its geometry, then decode its pixels."""

import warnings
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput, Grid
from glisson.io.decoding import check_image_size, decoding
from glisson.io.dicom_geometry import sorted_slices
from glisson.io.dicom_headers import ImageFile, Slice, image_files, slices_of
from glisson.io.dicom_pixels import stored_frames
from glisson.io.stored_image import StoredImage, in_c_order, whole_type


def read_dicom_folder(folder: Path, series_uid: str | None = None) -> StoredImage:
    """Read a CT or MR series, single-frame or multi-frame, compressed or not; rescaled to HU for CT.

    MONOCHROME1 says how values are shown, not what they are: it changes nothing here (but see masks).

    Args:
        folder: its images lie directly in it; other files are passed over.
        series_uid: which series, where there are several.

    Raises:
        BadInput: no series or several, tags missing, no regular grid, or pixels that cannot be decoded.
    """
    with decoding(folder, "a DICOM folder"), quiet():
        files = _one_series(folder, series_uid)
        modality = files[0].modality
        if modality not in ("CT", "MR"):
            raise BadInput(f"its modality is {modality or 'missing'}; Glisson reads CT and MR.")
        return _image(files, modality)


def read_dicom_mask(folder: Path) -> StoredImage:
    """Read a binary mask stored as a DICOM series: 1 where the pixels are not black, else 0.

    Raises:
        BadInput: as for `read_dicom_folder`.
    """
    with decoding(folder, "a DICOM mask"), quiet():
        slices, grid = _checked_slices(_one_series(folder, None), needs_rescale=False)
        voxels = np.zeros((len(slices), grid.shape[1], grid.shape[0]), dtype=np.uint8)
        for number, frame in _frames(slices):
            # In MONOCHROME1 the largest value is black.
            black = (1 << slices[number].bits_stored) - 1 if slices[number].is_inverted else 0
            voxels[number] = frame != black
        return StoredImage(in_c_order(voxels.T), grid)


def series_slices(folder: Path, series_uid: str | None = None) -> tuple[list[Slice], Grid]:
    """The slices of a series in a folder in the order of their places, and the grid that they make.

    Args:
        folder: its images lie directly in it.
        series_uid: which series, where there are several.

    Raises:
        BadInput: as for `read_dicom_folder`.
    """
    return _checked_slices(_one_series(folder, series_uid), needs_rescale=False)


def first_image(folder: Path) -> Path | None:
    """The first DICOM image that lies directly in a folder, by name; None where there is none."""
    with quiet():
        first = next(image_files(folder), None)
    return None if first is None else first.path


def has_dicom(folder: Path) -> bool:
    """Whether DICOM images lie directly in a folder."""
    return first_image(folder) is not None


@contextmanager
def quiet() -> Iterator[None]:
    """Without pydicom's warnings on values that break the standard's letter: what matters is checked here."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _one_series(folder: Path, series_uid: str | None) -> list[ImageFile]:
    files = list(image_files(folder))
    if not files:
        inner = [entry.name for entry in sorted(folder.iterdir()) if entry.is_dir() and has_dicom(entry)]
        hint = f"; its folders {', '.join(inner[:8])} do, so give one of them" if inner else ""
        raise BadInput(f"the folder holds no DICOM images{hint}.")
    counts = Counter(file.series for file in files)
    if series_uid is not None:
        if series_uid not in counts:
            raise BadInput(f"there is no series {series_uid}; there are {_listed(files)}.")
        return [file for file in files if file.series == series_uid]
    if len(counts) > 1:
        raise BadInput(f"the folder mixes {len(counts)} series; choose one: {_listed(files)}.")
    return files


def _listed(files: list[ImageFile]) -> str:
    parts = []
    for series in dict.fromkeys(file.series for file in files):
        members = [file for file in files if file.series == series]
        name = f" {members[0].description!r}" if members[0].description else ""
        images = sum(file.frames for file in members)
        parts.append(f"{series or '(no UID)'} ({members[0].modality}{name}, {images} images)")
    return "; ".join(parts[:12]) + ("; …" if len(parts) > 12 else "")


def _checked_slices(files: list[ImageFile], needs_rescale: bool) -> tuple[list[Slice], Grid]:
    slices = [one for file in files for one in slices_of(file, needs_rescale)]
    first = slices[0]
    check_image_size((*first.shape, len(slices)), 2)
    return sorted_slices(slices)


def _image(files: list[ImageFile], modality: str) -> StoredImage:
    slices, grid = _checked_slices(files, needs_rescale=modality == "CT")
    kind = _value_type(slices)
    voxels = np.zeros((len(slices), grid.shape[1], grid.shape[0]), dtype=kind)
    for number, frame in _frames(slices):
        slope, intercept = _rescale(slices[number])
        # Both fit: the type was chosen for the whole range of the stored bits.
        voxels[number] = frame.astype(kind) * kind.type(slope) + kind.type(intercept)
    return StoredImage(in_c_order(voxels.T), grid, modality=modality)


def _rescale(one: Slice) -> tuple[float, float]:
    return (1.0 if one.slope is None else one.slope), (0.0 if one.intercept is None else one.intercept)


def _value_type(slices: list[Slice]) -> np.dtype[Any]:
    """Smallest type for the rescaled values of all slices: whole where slopes and intercepts are."""
    ends: list[int] = []
    for one in slices:
        slope, intercept = _rescale(one)
        if slope == 0.0:
            raise BadInput(f"{one.path.name} has the rescale slope 0.")
        if slope != int(slope) or intercept != int(intercept):
            return np.dtype(np.float32)
        half = 1 << (one.bits_stored - 1)
        low, high = (-half, half - 1) if one.is_signed else (0, 2 * half - 1)
        scaled = (low * int(slope), high * int(slope))
        ends += [low, high, int(slope), int(intercept), *scaled, *(value + int(intercept) for value in scaled)]
    return whole_type(min(ends), max(ends))


def _frames(slices: list[Slice]) -> Iterator[tuple[int, NDArray[Any]]]:
    """Decoded stored values (rows, columns) of each slice with its number, file by file."""
    by_path: dict[Path, dict[int, int]] = {}
    for number, one in enumerate(slices):
        by_path.setdefault(one.path, {})[one.frame] = number
    for path, numbers in by_path.items():
        with decoding(path, "a DICOM image"):
            described = slices[next(iter(numbers.values()))]
            expected = described.shape[::-1]
            for frame, pixels in enumerate(stored_frames(described, len(numbers))):
                if pixels.shape != expected or frame not in numbers:
                    raise BadInput(f"its pixels have the size {pixels.shape}, its header says {expected}.")
                yield numbers.pop(frame), pixels
            if numbers:
                raise BadInput(f"{len(numbers)} of its frames are missing.")
