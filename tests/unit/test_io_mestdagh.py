"""The reader of the pulled liver: what is wrong with an archive is said, and the real ones agree with themselves."""

import io
import tarfile
from pathlib import Path

import numpy as np
import pytest

from glisson.core import BadInput
from glisson.io.mestdagh import read_pulled_mesh, read_pulled_sequence


def archive(path: Path, frames: int = 2, without: str = "", clouds: int = 2) -> Path:
    """A small archive as the data have them: metres and newtons."""
    arrays = {
        "positions-default.npy": np.full((frames, 4, 3), 0.001),
        "true-forces.npy": np.full((frames, 3), 0.5),
        "forces-vertices-remeshed.npy": np.array([1, 2]),
    }
    entries = {}
    for name, values in arrays.items():
        stream = io.BytesIO()
        np.save(stream, values)
        entries[name] = stream.getvalue()
    entries["tool-vertices-default.txt"] = b"3\n1\n"
    # Their order in the archive is not that of time.
    entries |= {
        f"pointclouds/pc{n:02d}.txt": f"0.0 0.0 {n}.0\n1.0 1.0 {n}.0\n".encode() for n in reversed(range(clouds))
    }
    with tarfile.open(path, "w:xz") as file:
        for name, content in entries.items():
            if name != without:
                entry = tarfile.TarInfo(f"sequences/neohookean/s1/{name}")
                entry.size = len(content)
                file.addfile(entry, io.BytesIO(content))
    return path


def test_metres_and_newtons_become_mm_and_mn_and_clouds_are_in_the_order_of_time(tmp_path: Path) -> None:
    sequence = read_pulled_sequence(archive(tmp_path / "a.tar.xz"))
    assert np.allclose(sequence.positions, 1.0)
    assert np.allclose(sequence.forces, 500.0)
    assert [cloud[0, 2] for cloud in sequence.clouds] == [0.0, 1000.0]
    assert sequence.tool.tolist() == [3, 1]
    assert sequence.candidates.tolist() == [1, 2]


def test_what_an_archive_lacks_is_said(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"no true-forces\.npy"):
        read_pulled_sequence(archive(tmp_path / "a.tar.xz", without="true-forces.npy"))
    with pytest.raises(BadInput, match="3 clouds, 2 positions"):
        read_pulled_sequence(archive(tmp_path / "b.tar.xz", clouds=3))
    (tmp_path / "c.tar.xz").write_bytes(b"nothing")
    with pytest.raises(BadInput, match="cannot be read"):
        read_pulled_sequence(tmp_path / "c.tar.xz")
    with pytest.raises(BadInput, match="does not exist"):
        read_pulled_sequence(tmp_path / "d.tar.xz")


@pytest.mark.real
@pytest.mark.parametrize("name", ["default", "remeshed"])
def test_held_nodes_of_the_real_meshes_lie_about_the_same_places(shared_data: Path, name: str) -> None:
    folder = shared_data / "open" / "mestdagh-liver-sequences"
    liver, other = read_pulled_mesh(folder, name), read_pulled_mesh(folder, "default")
    assert len(liver.held) == 105
    places, others = liver.mesh.nodes[liver.held], other.mesh.nodes[other.held]
    assert (
        np.linalg.norm(places[:, None] - others, axis=2).min(axis=1).max() < 8.0
    )  # an edge of the surface, which was meshed anew
    assert 1.3e6 < liver.mesh.volume_mm3 < 1.5e6  # 1437 ml, say the data


@pytest.mark.real
def test_held_nodes_of_a_real_sequence_do_not_move_and_clouds_lie_on_the_surface(shared_data: Path) -> None:
    folder = shared_data / "open" / "mestdagh-liver-sequences"
    liver = read_pulled_mesh(folder, "default")
    sequence = read_pulled_sequence(folder / "sequences-neohookean-s2.tar.xz")
    assert sequence.positions.shape == (50, len(liver.mesh.nodes), 3)
    assert np.array_equal(sequence.positions[:, liver.held], np.tile(liver.mesh.nodes[liver.held], (50, 1, 1)))
    for frame in (0, 49):
        corners = sequence.positions[frame][np.unique(liver.triangles)]
        away = np.linalg.norm(sequence.clouds[frame][:, None] - corners, axis=2).min(axis=1)
        assert away.max() < 8.0
