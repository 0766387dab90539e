"""VTK's legacy files (`.vtk`): poly data and unstructured grids, ASCII and binary, versions 1 to 5.1.

Reference: "VTK file formats", the legacy section of the VTK documentation. Only points and cells are
read; attributes are skipped. Binary numbers are big-endian.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput
from glisson.core.arrays import IntArray
from glisson.io.decoding import check_file_size
from glisson.io.vtk_xml import VtkCells

_DTYPES = {"float": "f4", "double": "f8", "int": "i4", "vtktypeint64": "i8", "vtktypeint32": "i4", "long": "i8"}
_DTYPES |= {"vtkidtype": "i8", "unsigned_int": "u4", "unsigned_long": "u8", "short": "i2", "char": "i1"}
_TRIANGLE, _POLYGON = 5, 7


def read_vtk_legacy(path: Path) -> VtkCells:
    """Read points and cells of a legacy file. Run inside `decoding`.

    Raises:
        BadInput: another data set than poly data or an unstructured grid, or numbers missing.
    """
    check_file_size(path)
    return _Scanner(path.read_bytes()).cells()


class _Scanner:
    """Walks through the sections that matter; whatever follows the last of them is left alone."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self._position = 0
        if not content.startswith(b"# vtk DataFile"):
            raise BadInput("it is no legacy VTK file (the first line must start with '# vtk DataFile').")
        self._line(), self._line()
        form = self._line().upper()
        if form not in ("ASCII", "BINARY"):
            raise BadInput(f"its third line must say ASCII or BINARY, not {form[:40]!r}.")
        self._binary = form == "BINARY"

    def cells(self) -> VtkCells:
        words = self._line().split()
        if len(words) != 2 or words[1].upper() not in ("POLYDATA", "UNSTRUCTURED_GRID"):
            raise BadInput(f"its data set is {' '.join(words)[:60]!r}; Glisson reads POLYDATA and UNSTRUCTURED_GRID.")
        section = "POLYGONS" if words[1].upper() == "POLYDATA" else "CELLS"
        points: NDArray[Any] | None = None
        topology: tuple[IntArray, IntArray] | None = None
        types: IntArray | None = None
        while (words := self._line().split()) and words[0].upper() not in ("POINT_DATA", "CELL_DATA"):
            key = words[0].upper()
            if key == "POINTS":
                points = self._numbers(int(words[1]) * 3, words[2]).reshape(-1, 3).astype(np.float64)
            elif key in (section, "VERTICES", "LINES"):
                found = self._topology(int(words[1]), int(words[2]))
                topology = found if key == section else topology
            elif key == "CELL_TYPES":
                types = self._numbers(int(words[1]), "int").astype(np.int64)
            elif key == "TRIANGLE_STRIPS":
                raise BadInput("it holds triangle strips; save it with plain triangles.")
            elif key == "METADATA":
                self._skip_metadata()
            else:
                raise BadInput(f"its section {key[:40]!r} is unknown.")
        if points is None or topology is None:
            raise BadInput(f"it lacks its POINTS or its {section}.")
        offsets, connectivity = topology
        if section == "POLYGONS":
            types = np.where(np.diff(offsets) == 3, _TRIANGLE, _POLYGON)
        if types is None or len(types) != len(offsets) - 1:
            raise BadInput("its cell types do not fit its cells.")
        return VtkCells(points, types, offsets, connectivity)

    def _topology(self, first: int, second: int) -> tuple[IntArray, IntArray]:
        """Offsets and connectivity; `first` and `second` are the two counts of the section's line."""
        mark = self._position
        words = self._line().split()
        if words and words[0].upper() == "OFFSETS":
            # Version 5: the first count is one more than there are cells.
            offsets = self._numbers(first, words[1]).astype(np.int64)
            connectivity = self._numbers(second, self._line().split()[1]).astype(np.int64)
        else:
            self._position = mark
            flat = self._numbers(second, "int").astype(np.int64)
            offsets, connectivity = _unflattened(flat, first)
        if not len(offsets) or offsets[0] != 0 or (np.diff(offsets) < 0).any() or offsets[-1] != len(connectivity):
            raise BadInput("the lengths of its cells do not add up.")
        return offsets, connectivity

    def _numbers(self, count: int, kind: str) -> NDArray[Any]:
        dtype = _DTYPES.get(kind.lower())
        if dtype is None:
            raise BadInput(f"its numbers of type {kind[:40]!r} are unknown.")
        if not 0 <= count <= len(self._content):
            raise BadInput(f"it announces {count} numbers, more than it can hold.")
        if self._binary:
            size = count * np.dtype(dtype).itemsize
            data = self._content[self._position : self._position + size]
            self._position += size
            values: NDArray[Any] = np.frombuffer(data, dtype=f">{dtype}") if len(data) == size else np.zeros(0)
        else:
            values = self._ascii_numbers(count, dtype)
        if len(values) != count:
            raise BadInput(f"it ends early: {count} numbers are announced.")
        return values

    def _ascii_numbers(self, count: int, dtype: str) -> NDArray[Any]:
        parts: list[NDArray[Any]] = []
        found = 0
        while found < count and self._position < len(self._content):
            # By lines, because the sections after the numbers are words.
            line = np.array(self._line().split(), dtype=dtype)
            parts.append(line)
            found += len(line)
        return np.concatenate(parts) if parts else np.zeros(0, dtype=dtype)

    def _line(self) -> str:
        """The next line that is not empty; "" at the end of the file."""
        while self._position < len(self._content):
            end = self._content.find(b"\n", self._position)
            end = len(self._content) if end < 0 else end
            text = self._content[self._position : end].decode("latin-1").strip()
            self._position = end + 1
            if text:
                return text
        return ""

    def _skip_metadata(self) -> None:
        # A metadata block ends with an empty line.
        end = self._content.find(b"\n\n", self._position)
        self._position = len(self._content) if end < 0 else end + 2


def _unflattened(flat: IntArray, cells: int) -> tuple[IntArray, IntArray]:
    """From "count, points …" for each cell, as versions before 5 store them."""
    if not 0 <= cells <= len(flat):
        raise BadInput("the lengths of its cells do not add up.")
    if cells and len(flat) % cells == 0 and (flat[:: len(flat) // cells] == len(flat) // cells - 1).all():
        size = len(flat) // cells - 1
        return np.arange(0, cells * size + 1, size) if size else np.zeros(cells + 1, np.int64), flat.reshape(cells, -1)[
            :, 1:
        ].ravel()
    starts = [0]
    position = 0
    keep = np.ones(len(flat), dtype=bool)
    for _ in range(cells):
        if position >= len(flat) or flat[position] < 0:
            raise BadInput("the lengths of its cells do not add up.")
        keep[position] = False
        starts.append(starts[-1] + int(flat[position]))
        position += 1 + int(flat[position])
    return np.array(starts), flat[keep]
