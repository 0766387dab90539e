"""Internal forces against public data: a liver pulled by a tool (Mestdagh and Cotin, MICCAI 2022)."""

import io
import tarfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import meshio
import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.mechanics.elasticity import Elasticity
from glisson.verification.check import Case, Check, relative, vanishing
from glisson.verification.shared_data import shared_folder

_MATERIAL = Material("neo-hookean-log", 4.5, 0.49)  # 4500 Pa
_FREE_THOUGH_LISTED = 756  # listed as fixed in the data, but it moves
_FRAMES = (0, 10, 25, 40, 49)
_SOURCE = "Mestdagh and Cotin 2022, their own finite elements"


def _sequence(archive_path: Path) -> dict[str, FloatArray]:
    wanted: dict[str, Callable[[io.BytesIO], FloatArray]]
    wanted = {"positions-default.npy": np.load, "true-forces.npy": np.load, "tool-vertices-default.txt": np.loadtxt}
    found = {}
    with tarfile.open(archive_path) as archive:
        for member in archive:
            name = Path(member.name).name
            content = archive.extractfile(member) if name in wanted else None
            if content is not None:
                found[name] = wanted[name](io.BytesIO(content.read()))
    return found


def _pulled(name: str, sequence: str) -> list[Check]:
    """Free nodes are in equilibrium at the given positions, and the tool pulls as strongly as was recorded."""
    folder = shared_folder("open", "mestdagh-liver-sequences")
    raw = meshio.read(folder / "mesh-default" / "liver.msh")
    # Metres and Pa in the data, mm and kPa here: forces come out in mN.
    mesh = TetMesh(raw.points * 1e3, raw.cells_dict["tetra"])
    held = np.load(folder / "mesh-default" / "dirichlet-vertices.npy")
    held = held[held != _FREE_THOUGH_LISTED]
    data = _sequence(folder / f"sequences-neohookean-{sequence}.tar.xz")
    tool = data["tool-vertices-default.txt"].astype(np.int64)
    free = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([held, tool]))
    body = Elasticity(mesh, {0: _MATERIAL}, mesh.nodes)
    forces = np.stack([body.forces(data["positions-default.npy"][frame] * 1e3) * 1e-3 for frame in _FRAMES])
    pulls, true = forces[:, tool].sum(axis=1), data["true-forces.npy"][list(_FRAMES)]
    apart = np.linalg.norm(pulls - true, axis=1).max()
    strongest = int(np.linalg.norm(true, axis=1).argmax())
    return [
        vanishing(f"{name}/free-nodes", np.abs(forces[:, free]).max(), 1e-6, "N", _SOURCE),
        vanishing(f"{name}/tool-difference", apart, 1e-3 * float(np.linalg.norm(true[strongest])), "N", _SOURCE),
        relative(
            f"{name}/tool-force",
            np.linalg.norm(pulls[strongest]),
            np.linalg.norm(true[strongest]),
            1e-3,
            "N",
            _SOURCE,
        ),
    ]


CASES = tuple(
    Case(name, f"forces at the nodes of sequence {sequence}, T4", partial(_pulled, name, sequence))
    for sequence in ("s1", "s2", "s3")
    for name in [f"mestdagh/{sequence}"]
)
