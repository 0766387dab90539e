import numpy as np
import pytest
import trimesh

from glisson.core.errors import BadInput
from glisson.core.fine_zone import FineZone
from glisson.core.image import Grid, LabelMap
from glisson.core.mesh import TET_EDGES, TriangleSurface
from glisson.preoperative.meshing.mesh_quality import mesh_quality
from glisson.preoperative.meshing.mmg import Mmg, MmgParameters
from glisson.preoperative.model.refinements import BallRefinement, TumourRefinement, fine_zones


def _tumour() -> LabelMap:
    grid = Grid((40, 40, 40), [1.0, 1.0, 1.0], [-20.0, -20.0, -20.0])
    points = grid.points_from_indices(np.argwhere(np.ones(grid.shape, dtype=bool)))
    inside = (np.linalg.norm(points - [8.0, 0.0, 0.0], axis=1) < 7.0).reshape(grid.shape)
    return LabelMap(inside.astype(np.uint8), grid, {1: "tumour1"})


def test_edges_are_short_about_the_tumour_and_long_elsewhere():
    made = trimesh.creation.icosphere(3, 40.0)
    surface = TriangleSurface(made.vertices, made.faces)
    (zone,) = fine_zones((TumourRefinement(reach_mm=3.0, edge_length_mm=3.0),), _tumour())
    mesh = Mmg(MmgParameters(edge_length_mm=16.0, envelope_mm=1.0)).mesh(surface, finer=(zone,))
    ends = mesh.nodes[mesh.corners[:, TET_EDGES]].reshape(-1, 2, 3)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    from_surface = np.abs(np.linalg.norm(ends.mean(axis=1) - [8.0, 0.0, 0.0], axis=1) - 7.0)
    assert np.median(length[from_surface < 3.0]) == pytest.approx(3.0, rel=0.2)
    assert np.percentile(length[from_surface < 3.0], 95) < 2.0 * 3.0
    assert np.median(length[from_surface > 20.0]) > 3.0 * 3.0
    assert mesh.volume_mm3 == pytest.approx(surface.volume_mm3, rel=0.005)
    assert mesh_quality(mesh).smallest_dihedral_deg > 5.0


def test_a_zone_is_where_it_was_asked_for():
    assert fine_zones((TumourRefinement(),), None) == ()
    (ball,) = fine_zones((BallRefinement((1.0, 2.0, 3.0), 15.0, 4.0),), None)
    assert ball.points_mm.tolist() == [[1.0, 2.0, 3.0]]
    assert (ball.reach_mm, ball.edge_length_mm) == (15.0, 4.0)
    with pytest.raises(BadInput, match="edge length above 0"):
        FineZone(np.zeros((1, 3)), 1.0, 0.0)
