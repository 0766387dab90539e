"""The demo's phantom and the truth that ships with it: sound, hard enough, in the same place as its CT."""

import numpy as np
import pytest

from glisson.core import BadInput, Board, Lever, Status
from glisson.geometry.distance import inside
from glisson.geometry.quadratic import boundary_surface
from glisson.phantom.demo import DEMO_TRUTH, demo_phantom
from glisson.phantom.lever_lift import LEVER_ANGLE_DEG
from glisson.phantom.truth import read_truth, write_truth
from glisson.phantom.truth_checks import (
    gap_to_lever,
    height_over_board,
    smallest_jacobian,
    surface_nodes,
    tumour_motion,
)


@pytest.fixture(scope="module")
def phantom():
    return demo_phantom((2.0, 2.0, 2.5))


@pytest.fixture(scope="module")
def truth():
    return DEMO_TRUTH.read()


def _tools(phantom):
    board, lever = phantom.scenario.tools
    assert isinstance(board, Board)
    assert isinstance(lever, Lever)
    return board, lever


def test_file_is_small():
    assert DEMO_TRUTH.path.stat().st_size < 2_000_000


def test_stages_are_those_of_the_scenario(phantom):
    assert phantom.seed == DEMO_TRUTH.seed
    assert [stage.name for stage in phantom.truth.stages] == [stage.name for stage in phantom.scenario.stages]
    assert phantom.truth.status is Status.CONVERGED
    assert "CalculiX" in phantom.truth.message


def test_no_element_is_inverted(truth):
    rest, scanned = truth.loading.mesh, truth.deformation.mesh
    states = [scanned.nodes, *(scanned.moved(stage.displacement) for stage in truth.deformation.stages)]
    assert smallest_jacobian(rest, rest.nodes) == pytest.approx(1.0)
    assert min(smallest_jacobian(rest, nodes) for nodes in states) > 0.5


def test_gravity_presses_the_organ_flat(truth):
    """Rest → A: mm of sag, a volume that changes as ν = 0.45 allows."""
    assert 1.0 < truth.loading.largest_mm < 10.0
    ratio = truth.deformation.mesh.volume_mm3 / truth.loading.mesh.volume_mm3
    assert 0.97 < ratio < 1.0


def test_tumour_moves_and_keeps_its_volume(phantom):
    motion = tumour_motion(phantom.truth, phantom.exact.tumours[0])
    assert motion.moved_mm > 15.0
    assert motion.volume_ratio == pytest.approx(1.0, abs=0.03)


def test_lobe_rests_on_the_lever(phantom):
    board, lever = _tools(phantom)
    mesh = phantom.truth.mesh
    outer = surface_nodes(mesh)
    for displacement in (np.zeros_like(mesh.nodes), *(stage.displacement for stage in phantom.truth.stages)):
        nodes = mesh.moved(displacement)[outer]
        angle = np.deg2rad(LEVER_ANGLE_DEG) if displacement.any() else 0.0
        gap = gap_to_lever(nodes, lever, angle)
        assert gap.min() > -0.25
        assert (gap < 0.2).sum() > 20
        assert height_over_board(nodes, board).min() > -0.25


def test_the_lobe_slides_in_stage_2(phantom):
    """Lower friction lets the lobe move along the lever; the settled tumour is elsewhere than after stage 1."""
    first, second = (stage.displacement for stage in phantom.truth.stages)
    assert 1.0 < np.linalg.norm(second - first, axis=1).max() < 15.0


def test_ct_shows_the_loaded_shape(phantom):
    """The mask is that of CalculiX's mesh in A, though it is painted from the implicit rest shape."""
    surface = boundary_surface(phantom.truth.mesh)
    assert phantom.organ.volume_ml("liver") == pytest.approx(surface.volume_mm3 * 1e-3, rel=0.01)
    voxels = np.argwhere(np.ones(phantom.organ.grid.shape, dtype=bool)[::3, ::3, ::3]) * 3
    points = phantom.organ.grid.points_from_indices(voxels)
    ours = phantom.organ.voxels[tuple(voxels.T)] > 0
    theirs = inside(points, surface)
    dice = 2.0 * (ours & theirs).sum() / (ours.sum() + theirs.sum())
    assert dice > 0.985


def test_interior_is_in_the_loaded_shape(phantom):
    surface = boundary_surface(phantom.truth.mesh)
    exact = phantom.exact
    assert inside(np.vstack([exact.duct.points_mm, *(tree.points_mm for tree in exact.trees)]), surface).all()
    voxels = np.argwhere(phantom.tumours.mask("tumour1"))
    centroid = phantom.tumours.grid.points_from_indices(voxels).mean(axis=0)
    assert np.linalg.norm(centroid - exact.tumours[0].centroid_mm) < 0.3
    assert exact.wire_length_mm < exact.duct.length_mm


def test_truth_survives_its_file(truth, tmp_path):
    path = tmp_path / "again.npz"
    stages = {stage.name: stage.displacement for stage in truth.deformation.stages}
    write_truth(path, truth.loading.mesh, truth.loading.displacement, stages, truth.deformation.message)
    again = read_truth(path)
    np.testing.assert_array_equal(again.deformation.mesh.nodes, truth.deformation.mesh.nodes)
    np.testing.assert_array_equal(again.deformation.displacement, truth.deformation.displacement)


def test_damaged_truth_is_refused(tmp_path):
    path = tmp_path / "damaged.npz"
    path.write_bytes(DEMO_TRUTH.path.read_bytes()[:5000])
    with pytest.raises(BadInput, match="not a truth file"):
        read_truth(path)
