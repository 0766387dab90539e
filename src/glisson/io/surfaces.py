"""Triangle surfaces from files: VTK (legacy and XML), PLY, STL, OBJ; out: STL, VTP, PLY (LPS mm)."""

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from glisson.core import BadInput, TriangleSurface
from glisson.core.arrays import FloatArray, IntArray
from glisson.io.atomic import atomic_path
from glisson.io.decoding import check_file_size, decoding
from glisson.io.units import LengthUnit, in_millimetres
from glisson.io.vtk_legacy import read_vtk_legacy
from glisson.io.vtk_xml import VtkCells, read_vtk_xml, write_vtp

_POINTS_AND_LINES = {1, 2, 3, 4}
_POLYGONS = {5, 7, 9}  # triangle, polygon, quadrangle


def read_surface(path: str | Path, unit: LengthUnit | None = None) -> TriangleSurface:
    """Read a surface; vertices keep their order and triangles their orientation.

    Polygons are cut into triangles as a fan, triangles that name a vertex twice are left out, and the
    corners of STL triangles that coincide exactly become one vertex. Whether the surface is closed is
    asked of the result (`is_closed`).

    Args:
        path: `.vtk`, `.vtp`, `.ply`, `.stl` or `.obj`.
        unit: of the coordinates; None takes mm if the size is that of an organ.

    Raises:
        BadInput: absent, damaged, no triangles, no area, points that are not finite, or a size that no
            organ has.
    """
    source = Path(path)
    with decoding(source, "a surface"):
        suffix = source.suffix.lower()
        if suffix in (".vtk", ".vtp"):
            cells = read_vtk_xml(source) if suffix == ".vtp" else read_vtk_legacy(source)
            vertices, triangles = cells.points, _triangles_of(cells)
        elif suffix in (".ply", ".stl", ".obj"):
            vertices, triangles = _by_trimesh(source, suffix[1:])
        else:
            raise BadInput("surfaces are read from .vtk, .vtp, .ply, .stl and .obj.")
        if not len(triangles):
            raise BadInput("it has no triangles.")
        surface = TriangleSurface(in_millimetres(vertices, unit), _without_collapsed(triangles))
        if surface.triangle_areas_mm2.sum() == 0.0:
            raise BadInput("all its triangles are degenerate (no area).")
        return surface


def write_surface(path: str | Path, surface: TriangleSurface) -> None:
    """Write a surface in mm as `.stl` (binary, single precision), `.ply` or `.vtp` (exact); atomic.

    Raises:
        BadInput: another suffix, or a place that cannot be written.
        WriteFailed: the disk is full.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    if suffix not in (".stl", ".ply", ".vtp"):
        raise BadInput(f"{target}: surfaces are written as .stl, .ply or .vtp.")
    with atomic_path(target) as temporary:
        if suffix == ".vtp":
            write_vtp(temporary, surface.vertices, surface.triangles)
        else:
            mesh: Any = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
            temporary.write_bytes(mesh.export(file_type=suffix[1:]))


def _triangles_of(cells: VtkCells) -> IntArray:
    kinds = {int(kind) for kind in np.unique(cells.types)} - _POINTS_AND_LINES
    if kinds - _POLYGONS:
        raise BadInput(
            f"it holds cells of the VTK types {sorted(kinds - _POLYGONS)}, so it is no surface of triangles."
        )
    triangles, _ = cells.of_type(5, 3)
    fans = [triangles]
    for cell in np.flatnonzero(np.isin(cells.types, [7, 9])):
        corners = cells.connectivity[cells.offsets[cell] : cells.offsets[cell + 1]]
        steps = np.arange(1, len(corners) - 1)
        fans.append(np.stack([np.full(len(steps), corners[0]), corners[steps], corners[steps + 1]], axis=1))
    return np.concatenate(fans)


def _by_trimesh(path: Path, kind: str) -> tuple[FloatArray, IntArray]:
    check_file_size(path)
    # From bytes, not by path: material and texture files that the mesh names are not opened.
    content = io.BytesIO(path.read_bytes())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mesh: Any = trimesh.load(
            content, file_type=kind, force="mesh", process=False, maintain_order=True, skip_materials=True
        )
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    triangles = np.asarray(mesh.faces, dtype=np.int64)
    if kind != "stl" or not len(triangles):
        return vertices, triangles
    # STL repeats a vertex in each of its triangles; numbered by first appearance.
    _, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    numbers = np.zeros(len(order), dtype=np.int64)
    numbers[order] = np.arange(len(order))
    return vertices[first[order]], numbers[inverse.reshape(-1)][triangles]


def _without_collapsed(triangles: IntArray) -> IntArray:
    ordered = np.sort(triangles, axis=1)
    kept: IntArray = triangles[(np.diff(ordered, axis=1) != 0).all(axis=1)]
    return kept
