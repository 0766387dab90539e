"""CalculiX's own test inputs and reference results, as far as checks need them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh


@dataclass(frozen=True, eq=False)
class InputMesh:
    """The T10 mesh of an input file; `numbers` (n,) are the file's own node numbers, in the mesh's order."""

    mesh: TetMesh
    numbers: IntArray

    @property
    def order(self) -> dict[int, int]:
        """The file's node number → ours."""
        return {int(number): position for position, number in enumerate(self.numbers)}


def cards(lines: Iterable[str]) -> list[tuple[str, list[str]]]:
    """The keyword lines of an input file in upper case, each with its data lines; comments are left out."""
    found: list[tuple[str, list[str]]] = []
    for line in lines:
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            found.append((line.strip().upper(), []))
        elif found:
            found[-1][1].append(line)
    return found


def fields(line: str) -> list[str]:
    """The values of a data line."""
    return [value.strip() for value in line.split(",") if value.strip()]


def read_t10(lines: Sequence[str]) -> InputMesh:
    """Nodes and C3D10 elements of an input file whose elements have eleven numbers each."""
    nodes: list[list[float]] = []
    numbers: list[int] = []
    for keyword, data in cards(lines):
        if keyword.startswith("*NODE,") or keyword == "*NODE":
            # Zeros at a line's end may be left out.
            nodes += [[float(value) for value in fields(line)] + [0.0] * (4 - len(fields(line))) for line in data]
        elif keyword.startswith("*ELEMENT"):
            numbers += [int(value) for line in data for value in fields(line)]
    table = np.array(nodes)
    own = table[:, 0].astype(np.int64)
    elements = np.array(numbers).reshape(-1, 11)[:, 1:]
    order = np.argsort(own)
    return InputMesh(TetMesh(table[:, 1:], order[np.searchsorted(own[order], elements)]), own)


def node_sets(lines: Sequence[str]) -> dict[str, list[int]]:
    """Node numbers of the file by the name of the set; ranges are left out."""
    found = {}
    for keyword, data in cards(lines):
        if keyword.startswith("*NSET") and "GENERATE" not in keyword:
            name = keyword.rpartition("NSET=")[2]
            found[name] = [int(value) for line in data for value in fields(line)]
    return found


def read_displacements(lines: Sequence[str]) -> tuple[IntArray, FloatArray]:
    """The first table of displacements of a .dat file: the file's node numbers (n,) and vectors (n, 3)."""
    start = next(number for number, line in enumerate(lines) if "displacements" in line) + 2
    rows = []
    for line in lines[start:]:
        if not line.strip():
            break
        rows.append([float(value) for value in line.split()])
    table = np.array(rows)
    return table[:, 0].astype(np.int64), table[:, 1:4]
