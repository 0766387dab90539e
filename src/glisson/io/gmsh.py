"""Gmsh meshes: version 1 ($NOD, $ELM) and version 2 ($Nodes, $Elements), ASCII here, binary by meshio.

Reference: Gmsh reference manual, "MSH file format version 1 (Legacy)" and "version 2 (Legacy)". No
library in use reads version 1, and meshio allocates by the largest node number, whatever a file claims it
to be. Of a T10 element Gmsh swaps the last two mid-side nodes against VTK and `glisson.core.mesh`.
"""

from pathlib import Path
from typing import Any

import meshio
import numpy as np

from glisson.core import BadInput
from glisson.core.arrays import FloatArray, IntArray
from glisson.io.decoding import check_file_size

VTK_FROM_GMSH = np.array([0, 1, 2, 3, 4, 5, 6, 7, 9, 8])
"""Gmsh's position of each T10 node in VTK's order."""

_NODES_OF_TYPE = {4: 4, 11: 10}
_OTHER_VOLUMES = {5: "hexahedra", 6: "prisms", 7: "pyramids", 12: "hexahedra", 17: "hexahedra"}


def read_gmsh(path: Path) -> tuple[FloatArray, IntArray, IntArray]:
    """Nodes (n, 3), tetrahedra (m, 4 or 10) in VTK's order, and the physical region of each (m,).

    Points, lines and triangles are left out. Run inside `decoding`.

    Raises:
        BadInput: another version, sections missing, counts that do not fit, unknown node numbers, other
            volume elements, or no tetrahedra.
    """
    check_file_size(path)
    content = path.read_bytes()
    start = content[:256].lstrip()
    if start.startswith((b"$NOD", b"$NOE")):
        return _ascii_mesh(content, ("$NOD", "$ENDNOD"), ("$ELM", "$ENDELM"), _version_1_nodes)
    words = content[:256].decode("latin-1").split()
    if len(words) < 4 or words[0] != "$MeshFormat" or not words[1].startswith("2"):
        version = words[1] if len(words) > 1 and words[0] == "$MeshFormat" else "unknown"
        raise BadInput(f"it is Gmsh version {version[:8]!r}; save it as version 2.2 (Mesh.MshFileVersion = 2.2).")
    if words[2] == "0":
        return _ascii_mesh(content, ("$Nodes", "$EndNodes"), ("$Elements", "$EndElements"), _version_2_nodes)
    return _binary_mesh(path)


def _ascii_mesh(
    content: bytes, node_marks: tuple[str, str], element_marks: tuple[str, str], split: Any
) -> tuple[FloatArray, IntArray, IntArray]:
    lines = [line.strip() for line in content.decode("latin-1").split("\n")]
    rows = np.array([line.split() for line in _section(lines, *node_marks)], dtype=np.float64)
    if rows.ndim != 2 or rows.shape[1] != 4:
        raise BadInput("its node lines must hold a number and three coordinates.")
    elements = [[int(word) for word in line.split()] for line in _section(lines, *element_marks)]
    if any(len(row) < 4 for row in elements):
        raise BadInput("an element line is cut short.")
    _refuse_others({_OTHER_VOLUMES[row[1]] for row in elements if row[1] in _OTHER_VOLUMES})
    tetrahedra = [row for row in elements if row[1] in _NODES_OF_TYPE]
    kinds = {row[1] for row in tetrahedra}
    if len(kinds) != 1:
        raise BadInput("it must hold tetrahedra, and all with 4 or all with 10 nodes.")
    count = _NODES_OF_TYPE[kinds.pop()]
    parts = [split(row) for row in tetrahedra]
    if any(len(nodes) != count for _, nodes in parts):
        raise BadInput(f"a tetrahedron has not {count} nodes.")
    named = np.array([nodes for _, nodes in parts], dtype=np.int64)
    regions = np.array([region for region, _ in parts], dtype=np.int64)
    return rows[:, 1:], _in_vtk_order(_positions(rows[:, 0], named)), regions


def _version_1_nodes(row: list[int]) -> tuple[int, list[int]]:
    # number, type, physical region, elementary region, count of nodes, nodes
    return row[2], row[5:] if row[4:5] == [len(row) - 5] else []


def _version_2_nodes(row: list[int]) -> tuple[int, list[int]]:
    # number, type, count of tags, tags (the first is the physical region), nodes
    return row[3] if row[2] else 0, row[3 + row[2] :] if row[2] >= 0 else []


def _binary_mesh(path: Path) -> tuple[FloatArray, IntArray, IntArray]:
    mesh = meshio.gmsh.read(path)
    blocks = [(block.type, block.data) for block in mesh.cells]
    _refuse_others({kind for kind, _ in blocks if kind.startswith(("hexahedron", "wedge", "pyramid"))})
    chosen = [number for number, (kind, _) in enumerate(blocks) if kind in ("tetra", "tetra10")]
    if len({blocks[number][0] for number in chosen}) != 1:
        raise BadInput("it must hold tetrahedra, and all with 4 or all with 10 nodes.")
    tetrahedra = np.concatenate([blocks[number][1] for number in chosen]).astype(np.int64)
    tags = mesh.cell_data.get("gmsh:physical")
    regions = np.concatenate([tags[number] for number in chosen]) if tags else np.zeros(len(tetrahedra))
    return np.asarray(mesh.points, dtype=np.float64), tetrahedra, regions.astype(np.int64)


def _in_vtk_order(tetrahedra: IntArray) -> IntArray:
    return tetrahedra[:, VTK_FROM_GMSH] if tetrahedra.shape[1] == 10 else tetrahedra


def _refuse_others(kinds: set[str]) -> None:
    if kinds:
        raise BadInput(f"it holds {' and '.join(sorted(kinds))}; Glisson reads tetrahedra only.")


def _section(lines: list[str], start: str, end: str) -> list[str]:
    if start not in lines or end not in lines:
        raise BadInput(f"it lacks the section {start} … {end}.")
    content = [line for line in lines[lines.index(start) + 1 : lines.index(end)] if line]
    if not content or int(content[0]) != len(content) - 1:
        announced = content[0] if content else 0
        raise BadInput(f"the section {start} announces {announced} lines but has {max(len(content) - 1, 0)}.")
    return content[1:]


def _positions(numbers: FloatArray, named: IntArray) -> IntArray:
    """Positions of node numbers, which need not be consecutive."""
    order = np.argsort(numbers, kind="stable")
    if len(np.unique(numbers)) != len(numbers):
        raise BadInput("two nodes have the same number.")
    found = np.searchsorted(numbers[order], named).clip(max=len(numbers) - 1)
    positions: IntArray = order[found]
    if (numbers[positions] != named).any():
        raise BadInput("an element names a node that is not there.")
    return positions
