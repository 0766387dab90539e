"""VTK's XML files for unstructured grids (`.vtu`) and surfaces (`.vtp`): points, cells, data.

Reference: "VTK XML file formats" in the VTK documentation. Read are ASCII, inline base64 and appended
arrays (base64 or raw), plain or packed by zlib or LZMA, in any number of pieces. Written are inline base64
arrays packed by zlib. Packed blocks never grow beyond the size that their header states.
"""

import base64
import lzma
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput
from glisson.core.arrays import FloatArray, IntArray
from glisson.io.decoding import check_file_size

_DTYPES = {f"{kind}{bits}": f"{kind[0].lower()}{bits // 8}" for kind in ("Int", "UInt") for bits in (8, 16, 32, 64)}
_DTYPES |= {"Float32": "f4", "Float64": "f8"}
_NAMES = {np.dtype(code): name for name, code in _DTYPES.items()}
_BLOCK = 1 << 20
_MAX_ARRAY_BYTES = 2**30


@dataclass(frozen=True, eq=False)
class VtkCells:
    """Points (n, 3), and cells of any VTK type.

    Cell c has the type `types[c]` and the points `connectivity[offsets[c]:offsets[c + 1]]`.
    """

    points: FloatArray
    types: IntArray
    offsets: IntArray
    connectivity: IntArray
    point_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    cell_data: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def of_type(self, vtk_type: int, corners: int) -> tuple[IntArray, IntArray]:
        """Points (m, corners) of all cells of one type, and their cell numbers (m,).

        Raises:
            BadInput: a cell of the type has another number of points, or names a point that is not there.
        """
        cells = np.flatnonzero(self.types == vtk_type)
        starts = self.offsets[cells]
        if (self.offsets[cells + 1] - starts != corners).any():
            raise BadInput(f"a cell of VTK type {vtk_type} has not {corners} points.")
        found = self.connectivity[starts[:, None] + np.arange(corners)]
        if found.size and not (found.min() >= 0 and found.max() < len(self.points)):
            raise BadInput(f"a cell names point {found.max()}, but there are {len(self.points)}.")
        return found, cells


def read_vtk_xml(path: Path) -> VtkCells:
    """Read a `.vtu` or `.vtp` file. Run inside `decoding`.

    Raises:
        BadInput: another kind of file, or sizes that do not fit.
    """
    check_file_size(path)
    reader = _Reader(path.read_bytes())
    return reader.cells()


def write_vtu(path: Path, cells: VtkCells) -> None:
    """Write an unstructured grid to `path` itself (the caller takes care of atomicity)."""
    arrays: dict[str, NDArray[Any]] = {
        "connectivity": cells.connectivity.astype(np.int64),
        "offsets": cells.offsets[1:].astype(np.int64),
        "types": cells.types.astype(np.uint8),
    }
    counts = {"NumberOfCells": str(len(cells.types))}
    _write(path, "UnstructuredGrid", cells, {"Cells": arrays}, counts)


def write_vtp(path: Path, points: FloatArray, triangles: IntArray) -> None:
    """Write triangles as poly data to `path` itself (the caller takes care of atomicity)."""
    offsets = np.arange(0, 3 * len(triangles) + 1, 3)
    cells = VtkCells(points, np.full(len(triangles), 5), offsets, triangles.ravel())
    arrays = {"connectivity": triangles.ravel().astype(np.int64), "offsets": offsets[1:].astype(np.int64)}
    _write(path, "PolyData", cells, {"Polys": arrays}, {"NumberOfPolys": str(len(triangles))})


def _write(
    path: Path, kind: str, cells: VtkCells, topology: dict[str, dict[str, NDArray[Any]]], counts: dict[str, str]
) -> None:
    root = ElementTree.Element(
        "VTKFile",
        type=kind,
        version="1.0",
        byte_order="LittleEndian",
        header_type="UInt64",
        compressor="vtkZLibDataCompressor",
    )
    grid = ElementTree.SubElement(root, kind)
    piece = ElementTree.SubElement(grid, "Piece", {"NumberOfPoints": str(len(cells.points)), **counts})
    groups: dict[str, Mapping[str, NDArray[Any]]] = {"Points": {"Points": cells.points.astype(np.float64)}}
    groups |= topology
    groups |= {"PointData": cells.point_data, "CellData": cells.cell_data}
    for section, arrays in groups.items():
        group = ElementTree.SubElement(piece, section)
        for name, values in arrays.items():
            _add_array(group, name, np.asarray(values))
    ElementTree.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _add_array(group: ElementTree.Element, name: str, values: NDArray[Any]) -> None:
    plain = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    attributes = {"type": _NAMES[np.dtype(values.dtype.newbyteorder("="))], "Name": name, "format": "binary"}
    if plain.ndim == 2:
        attributes["NumberOfComponents"] = str(plain.shape[1])
    data = plain.tobytes()
    blocks = [data[start : start + _BLOCK] for start in range(0, len(data), _BLOCK)]
    packed = [zlib.compress(block) for block in blocks]
    last = len(blocks[-1]) % _BLOCK if blocks else 0
    header = np.array([len(blocks), _BLOCK, last, *map(len, packed)], dtype="<u8")
    element = ElementTree.SubElement(group, "DataArray", attributes)
    element.text = base64.b64encode(header.tobytes()).decode() + base64.b64encode(b"".join(packed)).decode()


class _Reader:
    def __init__(self, content: bytes) -> None:
        # Raw appended data is no XML, so it is cut out before parsing.
        match = re.search(rb"<AppendedData([^>]*)>\s*_", content)
        head = content[: match.start()] + b"</VTKFile>" if match else content
        if b"<!DOCTYPE" in head or b"<!ENTITY" in head:
            raise BadInput("it declares a document type, which VTK files have not.")
        self._root = ElementTree.fromstring(head)
        self._appended = content[match.end() :] if match else b""
        self._appended_raw = match is not None and b"raw" in match.group(1)
        self._order = "<" if self._root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
        self._header_size = 8 if self._root.get("header_type") == "UInt64" else 4
        self._compressor = self._root.get("compressor", "")

    def cells(self) -> VtkCells:
        kind = self._root.get("type")
        if kind not in ("UnstructuredGrid", "PolyData"):
            raise BadInput(f"it holds VTK data of type {kind!r}, neither an unstructured grid nor poly data.")
        pieces = [self._piece(piece, kind) for piece in self._root.findall(f"{kind}/Piece")]
        if not pieces:
            raise BadInput("it has no piece.")
        return _joined(pieces)

    def _piece(self, piece: ElementTree.Element, kind: str) -> VtkCells:
        count = int(piece.get("NumberOfPoints", "0"))
        arrays = self._arrays(piece, "Points")
        points = next(iter(arrays.values())) if arrays else np.zeros((0, 3))
        if points.shape != (count, 3):
            raise BadInput(f"it has {points.shape} point coordinates where it announces {count} points.")
        cells = self._grid_cells(piece) if kind == "UnstructuredGrid" else self._polygons(piece)
        types, offsets, connectivity = cells
        increasing = len(offsets) > 0 and bool((np.diff(offsets) >= 0).all())
        if len(offsets) != len(types) + 1 or not increasing or offsets[-1] != len(connectivity):
            raise BadInput("the lengths of its cell arrays do not fit each other.")
        point_data = _fitting(self._arrays(piece, "PointData"), count)
        # The cell data of a surface also count its lines and vertices, which are not read.
        cell_data = _fitting(self._arrays(piece, "CellData"), len(types)) if kind == "UnstructuredGrid" else {}
        return VtkCells(points.astype(np.float64), types, offsets, connectivity, point_data, cell_data)

    def _grid_cells(self, piece: ElementTree.Element) -> tuple[IntArray, IntArray, IntArray]:
        arrays = {name: values.astype(np.int64) for name, values in self._arrays(piece, "Cells").items()}
        missing = {"connectivity", "offsets", "types"} - set(arrays)
        if missing:
            raise BadInput(f"its cells lack the arrays {sorted(missing)}.")
        offsets = np.concatenate([[0], arrays["offsets"].ravel()])
        return arrays["types"].ravel(), offsets, arrays["connectivity"].ravel()

    def _polygons(self, piece: ElementTree.Element) -> tuple[IntArray, IntArray, IntArray]:
        if int(piece.get("NumberOfStrips", "0")):
            raise BadInput("it holds triangle strips; save it with plain triangles.")
        arrays = {name: values.astype(np.int64).ravel() for name, values in self._arrays(piece, "Polys").items()}
        none = np.zeros(0, dtype=np.int64)
        offsets = np.concatenate([[0], arrays.get("offsets", none)])
        types = np.where(np.diff(offsets) == 3, 5, 7)
        return types, offsets, arrays.get("connectivity", none)

    def _arrays(self, piece: ElementTree.Element, section: str) -> dict[str, NDArray[Any]]:
        elements = piece.findall(f"{section}/DataArray")
        return {
            element.get("Name", section): self._values(element)
            for element in elements
            if element.get("type") in _DTYPES
        }

    def _values(self, element: ElementTree.Element) -> NDArray[Any]:
        dtype = np.dtype(self._order + _DTYPES[element.attrib["type"]])
        form = element.get("format", "ascii")
        if form == "ascii":
            values = np.array((element.text or "").split(), dtype=dtype.newbyteorder("="))
        else:
            values = np.frombuffer(self._payload(element, form), dtype=dtype).astype(dtype.newbyteorder("="))
        components = int(element.get("NumberOfComponents", "1") or 1)
        return values.reshape(-1, components) if components > 1 else values

    def _payload(self, element: ElementTree.Element, form: str) -> bytes:
        if form == "binary":
            text, raw = "".join((element.text or "").split()).encode(), False
        elif form == "appended":
            text, raw = self._appended[int(element.attrib["offset"]) :], self._appended_raw
        else:
            raise BadInput(f"its data format {form!r} is unknown.")
        if not self._compressor:
            size = int(self._header(text, raw, 1)[0])
            end = -(-self._header_size // 3) * 4
            if not raw and text[end - 1 : end] == b"=" and len(text) > end:
                # Some writers encode the length on its own, and padding ends it.
                return _cut(text[end:], raw, 0, size)
            return _cut(text, raw, 0, self._header_size + size)[self._header_size :]
        count = int(self._header(text, raw, 1)[0])
        if count == 0:
            return b""
        _refuse_above(count * self._header_size)
        _, block, last, *packed = (int(n) for n in self._header(text, raw, 3 + count))
        # The header of a packed array is encoded on its own.
        start = (3 + count) * self._header_size
        data = _cut(text, raw, start if raw else -(-start // 3) * 4, sum(packed))
        sizes = [block] * (count - 1) + [last or block]
        _refuse_above(sum(sizes))
        parts, position = [], 0
        for length, size in zip(packed, sizes, strict=True):
            parts.append(self._unpacked(data[position : position + length], size))
            position += length
        return b"".join(parts)

    def _header(self, text: bytes, raw: bool, count: int) -> NDArray[Any]:
        data = _cut(text, raw, 0, count * self._header_size)
        return np.frombuffer(data, dtype=f"{self._order}u{self._header_size}")

    def _unpacked(self, data: bytes, size: int) -> bytes:
        known: dict[str, Any] = {
            "vtkZLibDataCompressor": zlib.decompressobj,
            "vtkLZMADataCompressor": lzma.LZMADecompressor,
        }
        if self._compressor not in known:
            raise BadInput(f"its compressor {self._compressor} is not read; save it with zlib or uncompressed.")
        # One byte more than announced is asked for, so that a longer block is seen and never unpacked.
        unpacked: bytes = known[self._compressor]().decompress(data, size + 1)
        if len(unpacked) != size:
            raise BadInput("a packed block is longer or shorter than announced.")
        return unpacked


def _cut(text: bytes, raw: bool, start: int, size: int) -> bytes:
    """`size` bytes from position `start` of the raw or base64 text."""
    _refuse_above(size)
    data = text[start : start + size] if raw else base64.b64decode(text[start : start + -(-size // 3) * 4])
    if len(data) < size:
        raise BadInput("an array ends early.")
    return data[:size]


def _refuse_above(size: int) -> None:
    if not 0 <= size <= _MAX_ARRAY_BYTES:
        raise BadInput(f"an array of {size / 1e9:.1f} GB is more than Glisson reads ({_MAX_ARRAY_BYTES / 1e9:.1f} GB).")


def _fitting(arrays: dict[str, NDArray[Any]], count: int) -> dict[str, NDArray[Any]]:
    wrong = [name for name, values in arrays.items() if len(values) != count]
    if wrong:
        raise BadInput(f"its data array {wrong[0]!r} has {len(arrays[wrong[0]])} entries, not {count}.")
    return arrays


def _joined(pieces: list[VtkCells]) -> VtkCells:
    if len(pieces) == 1:
        return pieces[0]
    shifts = np.cumsum([0] + [len(piece.points) for piece in pieces])
    starts = np.cumsum([0] + [len(piece.connectivity) for piece in pieces])
    return VtkCells(
        np.concatenate([piece.points for piece in pieces]),
        np.concatenate([piece.types for piece in pieces]),
        np.concatenate([[0], *(p.offsets[1:] + start for p, start in zip(pieces, starts, strict=False))]),
        np.concatenate([piece.connectivity + shift for piece, shift in zip(pieces, shifts, strict=False)]),
        {key: np.concatenate([p.point_data[key] for p in pieces]) for key in pieces[0].point_data},
        {key: np.concatenate([p.cell_data[key] for p in pieces]) for key in pieces[0].cell_data},
    )
