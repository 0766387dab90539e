import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import trimesh
from skimage.measure import marching_cubes

from glisson.core import TetMesh, TriangleSurface
from glisson.preoperative.meshing.mesh_quality import face_connected_parts, mesh_quality, smallest_dihedral_angles_deg
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters


def sphere(radius: float = 40.0, subdivisions: int = 3) -> TriangleSurface:
    made = trimesh.creation.icosphere(subdivisions, radius)
    return TriangleSurface(made.vertices, made.faces)


def test_sphere_is_filled_and_nothing_is_printed(capfd):
    surface = sphere()
    mesh = Mmg(MmgParameters(edge_length_mm=16.0, envelope_mm=0.3)).mesh(surface)
    assert not mesh.is_quadratic
    assert (mesh.corner_volumes_mm3 > 0.0).all()
    assert mesh.volume_mm3 == pytest.approx(surface.volume_mm3, rel=0.001)
    # The boundary keeps to the envelope: the surface lies within 0.2 mm of the sphere by itself.
    assert np.abs(np.linalg.norm(mesh.surface().vertices, axis=1) - 40.0).max() < 0.3
    assert mesh.surface().is_closed
    assert face_connected_parts(mesh.corners)[0] == 1
    assert mesh_quality(mesh).smallest_dihedral_deg > 5.0
    assert len(np.unique(mesh.corners)) == len(mesh.nodes)
    assert capfd.readouterr() == ("", "")


def test_the_same_surface_gives_the_same_mesh():
    first, second = (Mmg(MmgParameters(edge_length_mm=16.0, envelope_mm=1.0)).mesh(sphere()) for _ in range(2))
    np.testing.assert_array_equal(first.nodes, second.nodes)
    np.testing.assert_array_equal(first.tetrahedra, second.tetrahedra)


def test_two_plates_that_almost_touch_stay_apart():
    """A fissure of 4 mm between plates of 12 mm, joined at one end: the mesh does not bridge it."""
    block = trimesh.creation.box((60.0, 40.0, 28.0))
    slot = trimesh.creation.box((60.0, 40.0, 4.0)).apply_translation((15.0, 0.0, 0.0))
    grid = np.stack(np.meshgrid(*[np.arange(-36.0, 37.0)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    level = np.maximum(box_level(grid, block.bounds), -box_level(grid, slot.bounds)).reshape(73, 73, 73)
    vertices, triangles, _, _ = marching_cubes(level, 0.0)
    surface = TriangleSurface(vertices - 36.0, triangles)
    mesh = Mmg(MmgParameters(edge_length_mm=12.0, envelope_mm=0.5)).mesh(surface)
    middle = mesh.nodes[mesh.corners].mean(axis=1)
    assert not ((np.abs(middle[:, 2]) < 1.0) & (middle[:, 0] > -10.0)).any()
    assert mesh_quality(mesh).pinched_edges == 0
    assert mesh_quality(mesh).smallest_dihedral_deg > 8.0


def box_level(points: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Negative inside a box, positive outside, (n,)."""
    return np.maximum(bounds[0] - points, points - bounds[1]).max(axis=1)


def test_dihedral_angles_of_known_tetrahedra():
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    corners = np.array([[0, 1, 2, 3]])
    np.testing.assert_allclose(smallest_dihedral_angles_deg(regular, corners), np.degrees(np.arccos(1 / 3)))
    np.testing.assert_allclose(smallest_dihedral_angles_deg(corner, corners), np.degrees(np.arccos(1 / np.sqrt(3))))


def test_quality_of_one_corner_tetrahedron():
    mesh = TetMesh([[0, 0, 0], [30, 0, 0], [0, 30, 0], [0, 0, 30]], [[0, 1, 2, 3]])
    quality = mesh_quality(mesh)
    assert (quality.elements, quality.nodes) == (1, 4)
    assert quality.volume_ml == pytest.approx(4.5)
    assert quality.shortest_edge_mm == pytest.approx(30.0)
    assert quality.longest_edge_mm == pytest.approx(30.0 * np.sqrt(2.0))


def test_parts_that_share_an_edge_only_are_two():
    tetrahedra = np.array([[0, 1, 2, 3], [0, 1, 4, 5], [1, 2, 3, 6]])
    count, part = face_connected_parts(tetrahedra)
    assert count == 2
    assert part[0] == part[2] != part[1]
    nodes = [[0, 0, 0], [0, 0, 1], [1, 0, 0], [0.5, 1, 0.5], [-1, 0, 0], [-0.5, -1, 0.5], [0.5, 0.3, 2]]
    made = TetMesh(nodes, [[0, 1, 2, 3], [0, 1, 4, 5]])
    assert mesh_quality(made).pinched_edges == 1


WAITING = """
import numpy as np, trimesh
from glisson.core import TriangleSurface
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
made = trimesh.creation.icosphere(5, 100.0)
surface = TriangleSurface(made.vertices, made.faces)
first = []
def progress(fraction, message):
    if not first and message.startswith("tetrahedra"):
        first.append(message)
        print("started", flush=True)
try:
    Mmg(MmgParameters(edge_length_mm=5.0, envelope_mm=0.3)).mesh(surface, progress)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def children_of(pid: int) -> list[int]:
    return [int(n) for task in Path(f"/proc/{pid}/task").glob("*/children") for n in task.read_text().split()]


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="looks for child processes in /proc")
def test_ctrl_c_ends_meshing_at_once():
    with subprocess.Popen([sys.executable, "-c", WAITING], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "started\n"
        children = children_of(process.pid)
        assert children
        before = time.monotonic()
        os.kill(process.pid, signal.SIGINT)
        assert process.stdout.readline() == "interrupted\n"
        assert time.monotonic() - before < 5.0
        process.wait(10.0)
    assert not any(Path(f"/proc/{child}").exists() for child in children)
