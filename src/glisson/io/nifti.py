"""NIfTI-1 and NIfTI-2 files (`.nii`, `.nii.gz`); RAS on disk, LPS inside.

Reference: the NIfTI-1 header file nifti1.h (NIfTI Data Format Working Group, 2004) for sform, qform,
units and extensions. Label names are kept in a header extension with the label table of Caret and
Connectome Workbench, which TotalSegmentator reads and writes and other tools skip.
"""

import gzip
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import nibabel
import numpy as np
from nibabel.imageglobals import LoggingOutputSuppressor
from numpy.typing import NDArray

from glisson.core import BadInput, Grid
from glisson.core.arrays import FloatArray
from glisson.io.atomic import atomic_path
from glisson.io.caret_labels import caret_table, names_from_caret
from glisson.io.decoding import DEFLATE_RATIO, check_image_size, decoding
from glisson.io.stored_image import StoredImage, in_c_order, rescaled, whole_type

_MM_PER_UNIT = {"unknown": 1.0, "mm": 1.0, "meter": 1000.0, "micron": 0.001}
_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
_CARET_CODE = 30
_SPACING_AGREEMENT = 0.01
_MODALITY = "modality "


def read_nifti(path: Path) -> StoredImage:
    """Read a 3-D NIfTI image with its exact geometry, scaling applied.

    Raises:
        BadInput: absent, damaged, too large, 4-D, sheared, without orientation or with an unusable spacing.
    """
    with decoding(path, "a NIfTI image"), warnings.catch_warnings(), LoggingOutputSuppressor():
        warnings.simplefilter("ignore")
        kind = _image_class(path)
        header = _checked_header(path, kind)
        image = kind.from_filename(path)
        grid = _grid(header)
        # Without nibabel's own scaling, which would make 64-bit floats of everything.
        stored = np.asarray(image.dataobj.get_unscaled()).reshape(grid.shape)
        slope, intercept = header.get_slope_inter()
        voxels = rescaled(stored, 1.0 if slope is None else slope, 0.0 if intercept is None else intercept)
        description = bytes(header["descrip"]).rstrip(b"\0").decode("latin-1")
        modality = description.removeprefix(_MODALITY) if description.startswith(_MODALITY) else None
        return StoredImage(in_c_order(voxels), grid, _names(image.header.extensions), modality)


def write_nifti(
    path: Path, voxels: NDArray[Any], grid: Grid, names: Mapping[int, str] | None = None, modality: str = ""
) -> None:
    """Write voxels [i, j, k] with sform and qform in mm; atomic. The geometry is kept to single precision.

    Raises:
        BadInput: the place cannot be written or an axis is too long for NIfTI-1.
        WriteFailed: the disk is full.
    """
    if max(grid.shape) > np.iinfo(np.int16).max:
        raise BadInput(f"{path}: NIfTI-1 cannot hold the size {grid.shape}; write .nrrd instead.")
    kind: Any = nibabel.Nifti1Image  # its methods carry no types
    image = kind(_storable(voxels), _LPS_FROM_RAS @ grid.lps_from_index)
    image.header.set_xyzt_units("mm")
    image.set_qform(image.affine, code="scanner")
    image.set_sform(image.affine, code="scanner")
    if modality:
        image.header["descrip"] = _MODALITY + modality
    if names is not None:
        image.header.extensions.append(nibabel.nifti1.Nifti1Extension(_CARET_CODE, caret_table(names)))
    with atomic_path(path) as temporary:
        image.to_filename(temporary)


def _image_class(path: Path) -> Any:
    with _open(path) as file:
        size = file.read(4)
    for kind in (nibabel.Nifti1Image, nibabel.Nifti2Image):
        if kind.header_class.sizeof_hdr in (int.from_bytes(size, "little"), int.from_bytes(size, "big")):
            return kind
    raise BadInput("it is not a NIfTI file (its first four bytes are no NIfTI header size).")


def _open(path: Path) -> Any:
    return gzip.open(path) if path.name.lower().endswith(".gz") else path.open("rb")


def _checked_header(path: Path, kind: Any) -> Any:
    # Read without nibabel's repairs, which would turn a negative spacing into a positive one.
    with _open(path) as file:
        block = file.read(kind.header_class.sizeof_hdr)
    header = kind.header_class(block, check=False)
    if not bytes(header["magic"]).startswith((b"n+1", b"n+2")):
        raise BadInput("it is not a single-file NIfTI image (pairs of .hdr and .img are not read).")
    shape = header.get_data_shape()
    if len(shape) < 3 or any(n != 1 for n in shape[3:]):
        raise BadInput(
            f"it has {len(shape)} dimensions ({' × '.join(map(str, shape))}); Glisson reads one 3-D image, so split it."
        )
    dtype = header.get_data_dtype()
    if dtype.kind not in "iuf":
        raise BadInput(f"its voxels are {dtype}, not plain numbers.")
    check_image_size(shape, dtype.itemsize)
    declared = int(np.prod(shape[:3], dtype=np.int64)) * dtype.itemsize
    ratio = DEFLATE_RATIO if path.name.lower().endswith(".gz") else 1
    if path.stat().st_size * ratio < declared:
        raise BadInput(f"it is shorter than its header says ({declared / 1e6:.1f} MB of voxels).")
    return header


def _grid(header: Any) -> Grid:
    """Sform first, else qform, both from RAS in the file's unit to LPS mm."""
    unit = header.get_xyzt_units()[0]
    if unit not in _MM_PER_UNIT:
        raise BadInput(f"its unit of length is {unit!r}; Glisson reads mm, metres and microns.")
    sizes = header["pixdim"][1:4].astype(np.float64)
    if not (np.isfinite(sizes).all() and (sizes > 0.0).all()):
        raise BadInput(f"its voxel spacing {sizes.tolist()} is not positive.")
    if int(header["sform_code"]) > 0:
        ras_from_index = header.get_sform()
    elif int(header["qform_code"]) > 0:
        ras_from_index = header.get_qform()
    else:
        raise BadInput("it states no orientation (sform and qform codes are 0), so left and right are unknown.")
    affine = _LPS_FROM_RAS @ np.asarray(ras_from_index, dtype=np.float64)
    if not np.isfinite(affine).all():
        raise BadInput("its orientation has values that are not finite numbers.")
    columns = np.linalg.norm(affine[:3, :3], axis=0)
    if np.abs(columns - sizes).max() > _SPACING_AGREEMENT * sizes.min():
        raise BadInput(
            f"its header gives two voxel spacings, {_short(sizes)} (pixdim) and {_short(columns)} (orientation)."
        )
    scale = _MM_PER_UNIT[unit]
    shape = header.get_data_shape()[:3]
    return Grid(shape, columns * scale, affine[:3, 3] * scale, affine[:3, :3] / columns)


def _short(values: FloatArray) -> str:
    return " × ".join(f"{value:.4g}" for value in values)


def _names(extensions: Any) -> dict[int, str]:
    for extension in extensions:
        text = bytes(extension.content).decode("utf-8", "replace")
        if "<LabelTable" in text:
            return names_from_caret(text)
    return {}


def _storable(voxels: NDArray[Any]) -> NDArray[Any]:
    if voxels.dtype == np.float16:
        return voxels.astype(np.float32)
    if voxels.dtype.kind == "b" or voxels.dtype in (np.int64, np.uint64):
        # Few tools read 64-bit integers.
        return voxels.astype(whole_type(int(voxels.min()), int(voxels.max())))
    return np.asarray(voxels)
