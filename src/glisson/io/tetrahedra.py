"""Tetrahedral meshes from files: VTU, legacy VTK, Gmsh 1 and 2; out: VTU (mm)."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core import BadInput, TetMesh
from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TET_FACES, signed_volumes
from glisson.io.atomic import atomic_path
from glisson.io.decoding import decoding
from glisson.io.gmsh import read_gmsh
from glisson.io.units import LengthUnit, in_millimetres
from glisson.io.vtk_legacy import read_vtk_legacy
from glisson.io.vtk_xml import VtkCells, read_vtk_xml, write_vtu

_T4, _T10 = 10, 24
_FLAT_CELLS = {1, 2, 3, 4, 5, 6, 7, 8, 9, 21, 22, 23}  # points, lines, triangles, quadrangles
_REGION_ARRAYS = ("region", "regions", "Region", "gmsh:physical")
_MIRROR = {4: [0, 2, 1, 3], 10: [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]}


def read_tetrahedra(path: str | Path, unit: LengthUnit | None = None) -> TetMesh:
    """Read a T4 or T10 mesh; T10 nodes come out in the order of `TetMesh`.

    Elements of the other orientation are turned where the mesh stays without overlap; a mesh that folds
    onto itself is refused. Nodes that no element uses are left out. Region numbers are the cell data
    "region" of VTU and the physical groups of Gmsh.

    Args:
        path: `.vtu`, `.vtk` or `.msh`.
        unit: of the coordinates; None takes mm if the size is that of an organ.

    Raises:
        BadInput: absent, damaged, no tetrahedra, other volume elements, flat or folded elements, or a size
            that no organ has.
    """
    source = Path(path)
    with decoding(source, "a tetrahedral mesh"):
        suffix = source.suffix.lower()
        if suffix == ".msh":
            nodes, tetrahedra, regions = read_gmsh(source)
        elif suffix in (".vtu", ".vtk"):
            nodes, tetrahedra, regions = tetrahedra_of(_vtk_cells(source))
        else:
            raise BadInput("tetrahedra are read from .vtu, .vtk and .msh.")
        if tetrahedra.min() < 0 or tetrahedra.max() >= len(nodes):
            raise BadInput(f"an element names a node that is not there ({len(nodes)} nodes).")
        used, numbered = np.unique(tetrahedra, return_inverse=True)
        nodes = in_millimetres(nodes[used], unit)
        return TetMesh(nodes, oriented(nodes, numbered.reshape(tetrahedra.shape)), regions)


def write_tetrahedra(
    path: str | Path,
    mesh: TetMesh,
    point_data: Mapping[str, ArrayLike] | None = None,
    cell_data: Mapping[str, ArrayLike] | None = None,
) -> None:
    """Write a mesh as `.vtu` with its regions and further arrays, one entry a node or an element; atomic.

    Raises:
        BadInput: another suffix, an array of the wrong length, or a place that cannot be written.
        WriteFailed: the disk is full.
    """
    target = Path(path)
    if target.suffix.lower() != ".vtu":
        raise BadInput(f"{target}: tetrahedra are written as .vtu.")
    cells = vtk_cells_of(mesh, point_data or {}, cell_data or {})
    with atomic_path(target) as temporary:
        write_vtu(temporary, cells)


def vtk_cells_of(mesh: TetMesh, point_data: Mapping[str, ArrayLike], cell_data: Mapping[str, ArrayLike]) -> VtkCells:
    """A mesh as VTK cells, with its regions and further arrays.

    Raises:
        BadInput: an array has the wrong length or does not hold numbers.
    """
    points = _checked(point_data, len(mesh.nodes))
    values = {"region": mesh.region_numbers} | _checked(cell_data, len(mesh.tetrahedra))
    count, corners = mesh.tetrahedra.shape
    types = np.full(count, _T10 if mesh.is_quadratic else _T4)
    offsets = np.arange(0, count * corners + 1, corners)
    return VtkCells(mesh.nodes, types, offsets, mesh.tetrahedra.ravel(), points, values)


def tetrahedra_of(cells: VtkCells) -> tuple[FloatArray, IntArray, IntArray]:
    """Nodes (n, 3), tetrahedra (m, 4 or 10) and regions (m,) of VTK cells, as they are stored.

    Raises:
        BadInput: other volume elements, T4 mixed with T10, or no tetrahedra.
    """
    kinds = {int(kind) for kind in np.unique(cells.types)} - _FLAT_CELLS
    if kinds - {_T4, _T10}:
        raise BadInput(f"it holds cells of the VTK types {sorted(kinds - {_T4, _T10})}; Glisson reads tetrahedra only.")
    if len(kinds) != 1:
        raise BadInput("it must hold tetrahedra, and all with 4 or all with 10 nodes.")
    kind = kinds.pop()
    tetrahedra, chosen = cells.of_type(kind, 10 if kind == _T10 else 4)
    named = [cells.cell_data[name] for name in _REGION_ARRAYS if name in cells.cell_data]
    regions = named[0][chosen] if named else np.zeros(len(chosen))
    if regions.ndim != 1 or not np.isfinite(regions).all() or (regions != np.rint(regions)).any():
        raise BadInput("its region numbers are not whole numbers.")
    return cells.points, tetrahedra, regions.astype(np.int64)


def oriented(nodes: FloatArray, tetrahedra: IntArray) -> IntArray:
    """The same elements, all of positive volume.

    Turning an element is harmless where the file merely numbers its nodes the other way round; then, once
    all are positive, two neighbours see their common face from opposite sides. In a mesh that folds onto
    itself they do not.

    Raises:
        BadInput: an element is flat, or the mesh folds onto itself.
    """
    volumes = signed_volumes(nodes, tetrahedra[:, :4])
    if (volumes == 0.0).any():
        raise BadInput(f"{int((volumes == 0.0).sum())} of its tetrahedra are flat; repair the mesh first.")
    turned = volumes < 0.0
    if not turned.any():
        return tetrahedra
    result = tetrahedra.copy()
    result[turned] = result[turned][:, _MIRROR[tetrahedra.shape[1]]]
    folded = _faces_seen_twice(result[:, :4])
    if folded:
        raise BadInput(
            f"{int(turned.sum())} of its {len(turned)} tetrahedra are inside out and the mesh folds onto itself "
            f"at {folded} faces; repair the mesh first."
        )
    return result


def _faces_seen_twice(corners: IntArray) -> int:
    """How many faces two elements see from the same side."""
    faces = corners[:, TET_FACES].reshape(-1, 3)
    # Rotate the smallest number to the front: what remains tells the sense of rotation.
    first = np.argmin(faces, axis=1)
    rows = np.arange(len(faces))
    rotated = np.stack([faces[rows, (first + step) % 3] for step in range(3)], axis=1)
    return len(rotated) - len(np.unique(rotated, axis=0))


def _vtk_cells(path: Path) -> VtkCells:
    return read_vtk_xml(path) if path.suffix.lower() == ".vtu" else read_vtk_legacy(path)


def _checked(arrays: Mapping[str, ArrayLike], count: int) -> dict[str, NDArray[Any]]:
    checked = {name: np.asarray(values) for name, values in arrays.items()}
    for name, values in checked.items():
        if len(values) != count or values.dtype.kind not in "iuf":
            raise BadInput(f"The array {name!r} must hold {count} numbers or vectors, not shape {values.shape}.")
    return checked
