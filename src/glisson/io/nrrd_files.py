"""NRRD files (`.nrrd`, and `.nhdr` with its data file beside it).

Reference: the NRRD format definition (teem, teem.sourceforge.net/nrrd/format.html). pynrrd reads and
writes; only the voxels are unpacked here, because they must not grow beyond what the header says.
"""

import bz2
import gzip
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO

import nrrd
import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput, Grid
from glisson.core.arrays import FloatArray
from glisson.io.atomic import atomic_path
from glisson.io.decoding import check_image_size, decoding
from glisson.io.stored_image import StoredImage, in_c_order

_NAMES_OF_TYPE = {
    "i1": ("signed char", "int8", "int8_t"),
    "u1": ("uchar", "unsigned char", "uint8", "uint8_t"),
    "i2": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "u2": ("ushort", "unsigned short", "unsigned short int", "uint16", "uint16_t"),
    "i4": ("int", "signed int", "int32", "int32_t"),
    "u4": ("uint", "unsigned int", "uint32", "uint32_t"),
    "i8": ("longlong", "long long", "long long int", "signed long long", "signed long long int", "int64", "int64_t"),
    "u8": ("ulonglong", "unsigned long long", "unsigned long long int", "uint64", "uint64_t"),
    "f4": ("float",),
    "f8": ("double",),
}
_LPS_SIGNS = {
    "left-posterior-superior": (1, 1, 1),
    "LPS": (1, 1, 1),
    "right-anterior-superior": (-1, -1, 1),
    "RAS": (-1, -1, 1),
    "left-anterior-superior": (1, -1, 1),
    "LAS": (1, -1, 1),
}
_MM_PER_UNIT = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "": 1.0}


def read_nrrd(path: Path) -> StoredImage:
    """Read a 3-D NRRD image with its exact geometry.

    Raises:
        BadInput: absent, damaged, too large, not 3-D, sheared, or without a patient coordinate system.
    """
    header, layers, grid = read_layers(path)
    if len(layers) != 1:
        raise BadInput(f"{path}: it has {len(layers)} layers; Glisson reads one 3-D image, so split it.")
    with decoding(path, "an NRRD image"):
        names = {int(k): str(v) for k, v in json.loads(header.get("label_names", "{}")).items()}
        return StoredImage(layers[0], grid, names, header.get("modality"))


def read_layers(path: Path) -> tuple[Mapping[str, Any], list[NDArray[Any]], Grid]:
    """Header, layers and geometry of an NRRD image; where it has four axes the first one counts layers [i, j, k].

    Raises:
        BadInput: as for `read_nrrd`, whatever the number of layers.
    """
    with decoding(path, "an NRRD image"), path.open("rb") as file:
        header = nrrd.read_header(file)
        sizes = [int(n) for n in header["sizes"]]
        if len(sizes) not in (3, 4) or int(header["dimension"]) != len(sizes):
            raise BadInput(f"it has {len(sizes)} dimensions; Glisson reads one 3-D image, so split it.")
        dtype = _dtype(header)
        check_image_size(sizes, dtype.itemsize)
        grid = _grid(header, sizes)
        voxels = _voxels(path, file, header, dtype).reshape(sizes, order="F")
        layers = [voxels] if len(sizes) == 3 else [voxels[n] for n in range(sizes[0])]
        return header, [in_c_order(layer.astype(dtype.newbyteorder("="))) for layer in layers], grid


def write_nrrd(
    path: Path, voxels: NDArray[Any], grid: Grid, names: Mapping[int, str] | None = None, modality: str = ""
) -> None:
    """Write voxels [i, j, k] gzip-compressed in LPS mm; atomic, geometry exact.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    said: dict[str, Any] = {"modality": modality} if modality else {}
    if names is not None:
        said["label_names"] = json.dumps({str(number): name for number, name in names.items()})
    # The format knows neither truth values nor half precision.
    known = {"b": np.uint8, "f": np.float32}.get(voxels.dtype.kind) if voxels.dtype.itemsize <= 2 else None
    write_layers(path, [voxels.astype(known) if known else voxels], grid, said)


def write_layers(path: Path, layers: Sequence[NDArray[Any]], grid: Grid, said: Mapping[str, Any]) -> None:
    """Write layers [i, j, k] of one type, several of them along a first axis of their own; atomic, geometry exact.

    Args:
        path: the file to make.
        layers: voxels on the grid.
        grid: where they lie.
        said: further fields of the header.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    directions, kinds = (grid.direction * grid.spacing_mm).T, ["domain"] * 3
    if len(layers) > 1:
        directions, kinds = np.vstack([np.full((1, 3), np.nan), directions]), ["list", *kinds]
    header = {
        "space": "left-posterior-superior",
        "space directions": directions,
        "space origin": grid.origin_mm,
        "space units": ["mm", "mm", "mm"],
        "kinds": kinds,
        "encoding": "gzip",
        **said,
    }
    with atomic_path(path) as temporary:
        stored = layers[0] if len(layers) == 1 else np.stack(layers)
        nrrd.write(str(temporary), stored, header, compression_level=6)


def _dtype(header: Mapping[str, Any]) -> np.dtype[Any]:
    code = next((code for code, names in _NAMES_OF_TYPE.items() if header["type"] in names), None)
    if code is None:
        raise BadInput(f"its voxels are of type {header['type']!r}, not plain numbers.")
    order = {"little": "<", "big": ">"}.get(header.get("endian", "little"))
    if order is None:
        raise BadInput(f"its byte order {header['endian']!r} is unknown.")
    dtype: np.dtype[Any] = np.dtype(order + code)
    return dtype


def _grid(header: Mapping[str, Any], sizes: list[int]) -> Grid:
    space = str(header.get("space", ""))
    signs = _LPS_SIGNS.get(space) or _LPS_SIGNS.get(space.lower())
    if signs is None or "space directions" not in header or "space origin" not in header:
        raise BadInput(
            "it states no patient coordinate system (space, space directions and space origin, "
            f"here space is {space or 'missing'}), so left and right are unknown."
        )
    units = header.get("space units", ["mm"] * 3)
    if len(set(units)) != 1 or units[0] not in _MM_PER_UNIT:
        raise BadInput(f"its units of length are {units}; Glisson reads mm, cm, m and um.")
    scale = _MM_PER_UNIT[units[0]] * np.array(signs, dtype=np.float64)
    rows = np.asarray(header["space directions"], dtype=np.float64)
    if rows.shape == (4, 3) and np.isnan(rows[0]).all():  # layers have no direction in space
        rows, sizes = rows[1:], sizes[1:]
    if len(sizes) != 3:
        raise BadInput(f"it has {len(sizes)} dimensions; Glisson reads one 3-D image, so split it.")
    columns = rows.T * scale[:, None]
    origin = np.asarray(header["space origin"], dtype=np.float64) * scale
    if columns.shape != (3, 3) or not np.isfinite(columns).all():
        raise BadInput("its space directions are not three finite vectors.")
    spacing: FloatArray = np.linalg.norm(columns, axis=0)
    if (spacing == 0.0).any():
        raise BadInput(f"its voxel spacing {spacing.tolist()} is not positive.")
    return Grid((sizes[0], sizes[1], sizes[2]), spacing, origin, columns / spacing)


def _voxels(path: Path, file: BinaryIO, header: Mapping[str, Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    detached = header.get("data file", header.get("datafile"))
    count = int(np.prod(header["sizes"], dtype=np.int64))
    if detached is None:
        return _decoded(file, header, dtype, count)
    # A header from elsewhere must not be able to name any file of this computer.
    if Path(detached).name != detached or detached.startswith("LIST") or "%" in detached:
        raise BadInput(f"its data file {detached!r} must be one file in the same folder.")
    with path.with_name(detached).open("rb") as data:
        return _decoded(data, header, dtype, count)


def _decoded(file: BinaryIO, header: Mapping[str, Any], dtype: np.dtype[Any], count: int) -> NDArray[Any]:
    for _ in range(int(header.get("line skip", header.get("lineskip", 0)))):
        file.readline()
    skip = int(header.get("byte skip", header.get("byteskip", 0)))
    if skip < 0:
        raise BadInput("a negative byte skip is not read.")
    file.seek(skip, 1)
    wanted = count * dtype.itemsize
    encoding = str(header["encoding"]).lower()
    # Reading so many bytes and no more is what keeps a small file from unpacking to gigabytes.
    if encoding == "raw":
        data = file.read(wanted)
    elif encoding in ("gzip", "gz"):
        data = gzip.GzipFile(fileobj=file).read(wanted)
    elif encoding in ("bzip2", "bz2"):
        data = bz2.BZ2File(file).read(wanted)
    else:
        raise BadInput(f"its encoding {encoding!r} is not read; save it as raw or gzip.")
    if len(data) < wanted:
        raise BadInput(f"it holds {len(data)} bytes of voxels where its header says {wanted}.")
    return np.frombuffer(data, dtype=dtype, count=count)
