"""Internal forces of the log-form neo-Hookean law against public data (Mestdagh and Cotin, MICCAI 2022)."""

import io
import tarfile
from pathlib import Path

import meshio
import numpy as np
import pytest

from glisson.core import Material, TetMesh
from glisson.mechanics.elasticity import Elasticity

MATERIAL = Material("neo-hookean-log", 4.5, 0.49)  # 4500 Pa
FREE_THOUGH_LISTED = 756  # listed as fixed in the data, but it moves


def _sequence(folder: Path, name: str) -> dict[str, np.ndarray]:
    wanted = {"positions-default.npy": np.load, "true-forces.npy": np.load, "tool-vertices-default.txt": np.loadtxt}
    found = {}
    with tarfile.open(folder / f"sequences-neohookean-{name}.tar.xz") as archive:
        for member in archive:
            reader = wanted.get(Path(member.name).name)
            if reader is not None:
                found[Path(member.name).name] = reader(io.BytesIO(archive.extractfile(member).read()))
    return found


@pytest.mark.real
@pytest.mark.parametrize("name", ["s1", "s2", "s3"])
def test_free_nodes_are_in_equilibrium_and_the_tool_force_is_theirs(shared_data: Path, name: str) -> None:
    folder = shared_data / "open" / "mestdagh-liver-sequences"
    raw = meshio.read(folder / "mesh-default" / "liver.msh")
    # Metres and Pa in the data, mm and kPa here: forces come out in mN.
    mesh = TetMesh(raw.points * 1e3, raw.cells_dict["tetra"])
    held = np.load(folder / "mesh-default" / "dirichlet-vertices.npy")
    held = held[held != FREE_THOUGH_LISTED]
    data = _sequence(folder, name)
    tool = data["tool-vertices-default.txt"].astype(int)
    free = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([held, tool]))
    body = Elasticity(mesh, {0: MATERIAL}, mesh.nodes)
    for frame in (0, 10, 25, 40, 49):
        forces = body.forces(data["positions-default.npy"][frame] * 1e3) * 1e-3
        assert np.abs(forces[free]).max() < 1e-6
        np.testing.assert_allclose(forces[tool].sum(axis=0), data["true-forces.npy"][frame], rtol=1e-3, atol=1e-4)
