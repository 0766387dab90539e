import numpy as np
import pytest

from glisson.geometry.normals import vertex_normals
from glisson.phantom.family import build_anatomy, make_phantom
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.ligaments import LIGAMENTS


@pytest.fixture(scope="module", params=[41, 42])
def liver(request):
    """Surface points of a liver, the part of them in each window, and how far they are from the vena cava, mm."""
    phantom = make_phantom(request.param, spacing_mm=(3.0, 3.0, 3.0))
    surface = MarchingCubes(MarchingCubesParameters()).extract(phantom.organ.mask("liver"), phantom.organ)
    points = surface.vertices
    normals = vertex_normals(points, surface.triangles)
    held = {name: window.chosen(points, normals) for name, window in LIGAMENTS.items()}
    return points, held, np.abs(build_anatomy(request.param).shape.cava.distance(points))


def test_each_lies_where_anatomy_has_it(liver):
    points, held, _ = liver
    middle = {name: points[chosen].mean(axis=0) for name, chosen in held.items()}
    across = ["right-triangular", "coronary", "falciform", "left-triangular"]
    assert np.all(np.diff([middle[name][0] for name in across]) > 15.0)  # from the right to the left
    centre = points.mean(axis=0)
    assert middle["falciform"][1] < centre[1] < middle["coronary"][1]  # in front, and behind
    assert min(middle[name][2] for name in held) > centre[2] - 10.0  # none hangs from below
    areas = [chosen.mean() for chosen in held.values()]
    assert min(areas) > 0.005
    assert max(areas) < 0.15


def test_what_the_vena_cava_holds_lies_at_it(liver):
    _, held, from_cava = liver
    assert np.percentile(from_cava[held["vena-cava"]], 90) < 3.0


def test_a_ligament_ends_where_its_surface_turns_away():
    points = np.array([[0.5, 0.2, 0.9], [0.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.58, 0.2, 0.9]])
    up, down = np.tile([0.0, -0.6, 0.8], (4, 1)), np.tile([0.0, 0.6, -0.8], (4, 1))
    assert LIGAMENTS["falciform"].chosen(points, up).tolist() == [False, False, False, True]
    assert not LIGAMENTS["falciform"].chosen(points, down).any()
