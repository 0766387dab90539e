"""A mesh with what is known of it, as two files that belong together: `NAME.vtu` and `NAME.json`.

The JSON file holds the SHA-256 of the mesh file, so that a pair of different runs is never taken for one.
"""

import hashlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from glisson.core import BadInput, TetMesh
from glisson.io.atomic import atomic_paths
from glisson.io.decoding import decoding
from glisson.io.records import Record, json_text, read_record
from glisson.io.tetrahedra import tetrahedra_of, vtk_cells_of
from glisson.io.vtk_xml import VtkCells, read_vtk_xml, write_vtu


def write_pair(
    folder: Path, name: str, mesh: TetMesh, point_data: Mapping[str, NDArray[Any]], values: Mapping[str, Any]
) -> None:
    """Write both files into `folder`; neither replaces an old one before both are complete.

    Raises:
        BadInput: the place cannot be written.
        WriteFailed: the disk is full.
    """
    with atomic_paths(folder / f"{name}.vtu", folder / f"{name}.json") as (mesh_path, values_path):
        write_vtu(mesh_path, vtk_cells_of(mesh, point_data, {}))
        digest = hashlib.sha256(mesh_path.read_bytes()).hexdigest()
        values_path.write_text(json_text({**values, "mesh_sha256": digest}), encoding="utf-8")


@contextmanager
def read_pair(folder: Path, name: str, kind: str, schema: int) -> Iterator[tuple[TetMesh, VtkCells, Record]]:
    """The mesh, its arrays, and the record; complaints inside the block name the JSON file.

    Raises:
        BadInput: a file is absent, damaged or of a newer Glisson, or they do not belong together.
    """
    if folder.is_file():
        raise BadInput(f"{folder} is a file; give the folder with {name}.vtu and {name}.json.")
    mesh_path = folder / f"{name}.vtu"
    with decoding(mesh_path, "a VTU mesh"):
        cells = read_vtk_xml(mesh_path)
        nodes, tetrahedra, regions = tetrahedra_of(cells)
        mesh = TetMesh(nodes, tetrahedra, regions)
        digest = hashlib.sha256(mesh_path.read_bytes()).hexdigest()
    with read_record(folder / f"{name}.json", kind, schema) as record:
        if record.text("mesh_sha256") != digest:
            raise BadInput(f"it does not belong to the {name}.vtu beside it; run the stage that writes both again.")
        yield mesh, cells, record
