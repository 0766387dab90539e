import numpy as np
import pytest

from glisson.geometry.normals import vertex_normals
from glisson.phantom.family import build_anatomy, make_phantom
from glisson.preoperative.meshing.surface import MarchingCubes, MarchingCubesParameters
from glisson.preoperative.model.ligaments import LIGAMENTS, Hollow, Window


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
    assert min(middle[name][2] for name in held if name != "hilum") > centre[2] - 10.0  # none hangs from below
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


def test_the_hilum_lies_where_the_portal_vein_enters(capsys):
    """Its middle against the place of the phantom's portal trunk in the surface."""
    apart = []
    for seed in range(41, 49):
        organ = make_phantom(seed, spacing_mm=(3.0, 3.0, 3.0)).organ
        surface = MarchingCubes(MarchingCubesParameters()).extract(organ.mask("liver"), organ)
        points = surface.vertices
        chosen = LIGAMENTS["hilum"].chosen(points, vertex_normals(points, surface.triangles))
        in_trunk = build_anatomy(seed).shape.portal_trunk.distance(points) < 1.0
        apart.append(np.linalg.norm(points[chosen].mean(axis=0) - points[in_trunk].mean(axis=0)))
    with capsys.disabled():
        print(f"\nhilum from the portal trunk: median {np.median(apart):.1f} mm, worst {max(apart):.1f} mm")
    assert max(apart) < 15.0  # half the length of the phantom's hilum


def test_a_hollow_is_what_lies_deep_below_the_hull():
    """A cone-shaped dent, 0.4 deep, in the flat underside of a block: the part above half its depth."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.linspace(-1.0, 1.0, 41)] * 2))
    dent = 0.4 * np.maximum(1.0 - np.hypot(x, y) / 0.53, 0.0)
    points = np.concatenate([np.stack([x, y, dent], axis=1), [[a, b, 2.0] for a in (-1, 1) for b in (-1, 1)]])
    normals = np.tile([0.0, 0.0, -1.0], (len(points), 1))
    window, nowhere = (Window((0.0, most), (0.0, 1.0), (0.0, 1.0), (0.0, 0.0, -1.0)) for most in (1.0, -1.0))
    assert np.array_equal(
        Hollow(window, nowhere).chosen(points, normals), (points[:, 2] > 0.2 - 1e-9) & (points[:, 2] < 1)
    )
    assert not Hollow(window, window).chosen(points, normals).any()
