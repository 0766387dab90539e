"""The public sequences of a liver pulled by a tool (Mestdagh and Cotin, MICCAI 2022), in mm and mN.

A folder holds `mesh-default`, on which the data were made, `mesh-remeshed` for whoever reconstructs them, and archives
`sequences-LAW-sN.tar.xz`.
"""

import io
import re
import tarfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput, TetMesh
from glisson.core.arrays import FloatArray, IntArray
from glisson.io.decoding import decoding
from glisson.io.tetrahedra import read_tetrahedra

_MM = 1e3  # metres, and N, in the data
_FREE_THOUGH_LISTED = 756  # in mesh-default: the data list it as held, but it moves by up to 5 mm
_SAME_PLACE_MM = 1e-3
_MAX_ENTRY_BYTES = 2**27
_CLOUD = re.compile(r"pc(\d+)\.txt")


@dataclass(frozen=True, eq=False)
class PulledMesh:
    """A mesh at rest, the nodes that are held (h,), and the triangles (t, 3) on which clouds lie."""

    mesh: TetMesh
    held: IntArray
    triangles: IntArray


@dataclass(frozen=True, eq=False)
class PulledSequence:
    """True node positions (f, n, 3) on `mesh-default`, true forces (f, 3) in mN, and a point cloud for each frame.

    `tool` are the nodes of `mesh-default` that the tool pulls; forces may be looked for on `candidates` of
    `mesh-remeshed`.
    """

    positions: FloatArray
    forces: FloatArray
    clouds: tuple[FloatArray, ...]
    tool: IntArray
    candidates: IntArray


def read_pulled_mesh(folder: str | Path, name: str) -> PulledMesh:
    """Mesh "default" or "remeshed"; a node that is listed as held though it moves is left out.

    Raises:
        BadInput: a file is absent or damaged.
    """
    mesh, held, triangles = _mesh(Path(folder), name)
    default, _, _ = (mesh, held, triangles) if name == "default" else _mesh(Path(folder), "default")
    loose = default.nodes[_FREE_THOUGH_LISTED]
    apart = np.linalg.norm(mesh.nodes[held] - loose, axis=1) > _SAME_PLACE_MM
    return PulledMesh(mesh, held[apart], triangles)


def read_pulled_sequence(path: str | Path) -> PulledSequence:
    """One `sequences-LAW-sN.tar.xz`.

    Raises:
        BadInput: absent, damaged, or something is missing in it.
    """
    source = Path(path)
    with decoding(source, "an archive of a pulled liver"):
        arrays: dict[str, NDArray[Any]] = {}
        with tarfile.open(source) as archive:
            for member in archive:
                content = archive.extractfile(member) if member.isfile() else None
                if content is None:
                    continue
                if member.size > _MAX_ENTRY_BYTES:
                    raise BadInput(f"{member.name} in it is too large.")
                stream = io.BytesIO(content.read())
                text = member.name.endswith(".txt")
                arrays[Path(member.name).name] = np.loadtxt(stream) if text else np.load(stream, allow_pickle=False)
        numbers = sorted((int(match[1]), name) for name in arrays if (match := _CLOUD.fullmatch(name)))
        clouds = tuple(arrays[name] * _MM for _, name in numbers)
        positions, forces = _needed(arrays, "positions-default.npy") * _MM, _needed(arrays, "true-forces.npy") * _MM
        if not len(clouds) == len(positions) == len(forces):
            raise BadInput(f"it has {len(clouds)} clouds, {len(positions)} positions and {len(forces)} forces.")
        tool = _needed(arrays, "tool-vertices-default.txt").astype(np.int64)
        candidates = _needed(arrays, "forces-vertices-remeshed.npy").astype(np.int64)
        return PulledSequence(positions, forces, clouds, tool, candidates)


def _mesh(folder: Path, name: str) -> tuple[TetMesh, IntArray, IntArray]:
    place = folder / f"mesh-{name}"
    found = read_tetrahedra(place / "liver.msh", "m")
    mesh = TetMesh(found.nodes, found.tetrahedra)  # of one material
    return mesh, _array(place / "dirichlet-vertices.npy"), _array(place / "matching-triangles.npy")


def _array(path: Path) -> IntArray:
    with decoding(path, "an array"):
        numbers: IntArray = np.load(path, allow_pickle=False).astype(np.int64)
        return numbers


def _needed(arrays: dict[str, NDArray[Any]], name: str) -> NDArray[Any]:
    if name not in arrays:
        raise BadInput(f"there is no {name} in it.")
    return arrays[name]
