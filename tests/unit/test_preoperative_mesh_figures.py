"""The four figures of a liver's mesh: volume, closeness to the true border, worst angle, elements and seconds."""

import time

import numpy as np
import pytest
import trimesh

from glisson.phantom.family import build_anatomy, make_phantom
from glisson.preoperative.meshing.mesh_quality import mesh_quality
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters

VOXEL_MM = 1.6


@pytest.mark.parametrize("seed", [41, 43])
def test_the_mesh_keeps_within_half_a_voxel_of_the_phantoms_border(seed, capsys):
    """The border is the closed form that the mask was made from."""
    organ = make_phantom(seed, spacing_mm=(VOXEL_MM,) * 3).organ
    surface = MarchingCubes(MarchingCubesParameters()).extract(organ.mask("liver"), organ)
    start = time.perf_counter()
    mesh = Mmg(MmgParameters()).mesh(surface)
    seconds = time.perf_counter() - start
    quality, border = mesh_quality(mesh), mesh.surface()
    volume_error = quality.volume_ml / organ.volume_ml("liver") - 1.0
    points, _ = trimesh.sample.sample_surface(trimesh.Trimesh(border.vertices, border.triangles), 20000, seed=0)
    p95 = np.percentile(np.abs(build_anatomy(seed).shape.liver.distance(np.asarray(points))), 95)
    with capsys.disabled():
        print(
            f"\nphantom {seed}: volume {100.0 * volume_error:+.2f} %, 95 % within {p95:.2f} mm, smallest dihedral "
            f"{quality.smallest_dihedral_deg:.1f}°, {quality.elements} elements in {seconds:.1f} s"
        )
    assert abs(volume_error) < 0.005
    assert p95 < 0.5 * VOXEL_MM
    assert quality.smallest_dihedral_deg > 8.0
    assert 10_000 < quality.elements < 25_000
    assert seconds < 20.0
