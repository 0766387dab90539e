import numpy as np
import pytest
from blocks import bent, block

from glisson.core import BadInput, Plane, TetMesh
from glisson.geometry.cutting import volume_beyond
from glisson.geometry.planes import angle_between_deg, fit_plane, plane_basis
from glisson.geometry.quadratic import boundary_surface, straight_tetrahedra


def ball(cells: int = 8) -> TetMesh:
    """A cube mesh pulled onto the unit sphere, every node by its largest coordinate."""
    cube = block((cells,) * 3, (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0))
    length = np.linalg.norm(cube.nodes, axis=1)
    scale = np.abs(cube.nodes).max(axis=1) / np.where(length > 0.0, length, 1.0)
    return TetMesh(cube.nodes * scale[:, None], cube.tetrahedra)


@pytest.mark.parametrize("mesh", [block((5, 4, 3), (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0)), ball()])
def test_halves_sum_to_the_whole(mesh):
    rng = np.random.default_rng(4)
    for _ in range(20):
        plane = Plane(rng.uniform(-0.8, 0.8, 3), rng.normal(size=3))
        beyond = volume_beyond(mesh.nodes, mesh.corners, plane)
        before = volume_beyond(mesh.nodes, mesh.corners, Plane(plane.point_mm, -plane.normal))
        np.testing.assert_allclose(beyond + before, mesh.corner_volumes_mm3, rtol=1e-12, atol=1e-15)
        assert abs(beyond.sum() + before.sum() - mesh.volume_mm3) < 1e-12 * mesh.volume_mm3


def test_central_symmetry_halves_cube_and_ball():
    for mesh in (block((3, 3, 3), (2.0, 2.0, 2.0), (-1.0, -1.0, -1.0)), ball(6)):
        normal = np.array([0.3, -0.5, 0.8])
        part = volume_beyond(mesh.nodes, mesh.corners, Plane(np.zeros(3), normal)).sum()
        assert part == pytest.approx(mesh.volume_mm3 / 2.0, rel=1e-12)


def test_wedge_of_a_box():
    """A plane through the edge x = 0, z = 0 of a box a × b × c removes the triangle prism a² tan θ · b / 2."""
    a, b, c = 4.0, 3.0, 5.0
    mesh = block((3, 2, 4), (a, b, c))
    for slope in (0.2, 0.7, 1.2):
        plane = Plane(np.zeros(3), [slope, 0.0, -1.0])
        part = volume_beyond(mesh.nodes, mesh.corners, plane).sum()
        assert part == pytest.approx(a * a * slope * b / 2.0, rel=1e-12)


def test_one_tetrahedron_against_its_closed_form():
    corners = np.array([[0, 1, 2, 3]])
    nodes = np.vstack([np.zeros(3), np.eye(3)])
    for t in (0.1, 0.5, 0.9):
        plane = Plane([t, 0.0, 0.0], [1.0, 0.0, 0.0])
        assert volume_beyond(nodes, corners, plane)[0] == pytest.approx((1.0 - t) ** 3 / 6.0, rel=1e-13)
    touching = Plane([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    assert volume_beyond(nodes, corners, touching)[0] == 1.0 / 6.0
    two = Plane([0.25, 0.25, 0.0], [1.0, 1.0, 0.0])  # x + y > 1/2 within the unit corner: 1/6 − ∫₀^½ s (1 − s) ds
    assert volume_beyond(nodes, corners, two)[0] == pytest.approx(1.0 / 6.0 - (1.0 / 8.0 - 1.0 / 24.0), rel=1e-13)


def test_random_planes_against_monte_carlo():
    rng = np.random.default_rng(5)
    nodes, corners = rng.normal(size=(4, 3)), np.array([[0, 1, 2, 3]])
    whole = abs(np.linalg.det(nodes[1:] - nodes[0])) / 6.0
    if np.linalg.det(nodes[1:] - nodes[0]) < 0.0:
        corners = corners[:, [0, 2, 1, 3]]
    samples = rng.dirichlet(np.ones(4), 200_000) @ nodes
    for _ in range(5):
        plane = Plane(nodes.mean(axis=0) + 0.2 * rng.normal(size=3), rng.normal(size=3))
        share = float((plane.distance_mm(samples) > 0.0).mean())
        sigma = np.sqrt(max(share * (1.0 - share), 1e-6) / len(samples))
        assert volume_beyond(nodes, corners, plane)[0] / whole == pytest.approx(share, abs=5.0 * sigma)


def test_eight_straight_tetrahedra_fill_a_quadratic_element():
    mesh = block((2, 2, 2), (20.0, 20.0, 20.0)).as_quadratic()
    eight = straight_tetrahedra(mesh)
    parts = volume_beyond(mesh.nodes, eight, Plane([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0])).reshape(-1, 8)
    np.testing.assert_allclose(parts, np.repeat(mesh.corner_volumes_mm3[:, None] / 8.0, 8, axis=1), rtol=1e-12)
    surface = boundary_surface(mesh)
    assert surface.is_closed
    assert surface.volume_mm3 == pytest.approx(8000.0, rel=1e-12)


def test_the_curved_boundary_encloses_the_curved_elements():
    mesh = block((6, 2, 2), (60.0, 20.0, 20.0)).as_quadratic()
    nodes = bent(mesh.nodes)
    surface = boundary_surface(mesh, nodes)
    beyond = volume_beyond(nodes, straight_tetrahedra(mesh), Plane([-1e3, 0.0, 0.0], [1.0, 0.0, 0.0]))
    assert surface.volume_mm3 == pytest.approx(beyond.sum(), rel=1e-12)


def test_a_fitted_plane_is_the_plane_of_its_points():
    plane = Plane([3.0, -2.0, 7.0], [1.0, 2.0, -2.0])
    u, v = plane_basis(plane)
    rng = np.random.default_rng(6)
    points = plane.point_mm + rng.normal(size=(50, 1)) * u + rng.normal(size=(50, 1)) * v
    fit = fit_plane(points, towards=plane.normal)
    assert angle_between_deg(fit.plane, plane) < 1e-9
    assert fit.rms_mm < 1e-12
    off = fit_plane(np.vstack([points + 0.5 * plane.normal, points - 0.5 * plane.normal]), towards=-plane.normal)
    assert off.rms_mm == pytest.approx(0.5, rel=1e-12)
    assert angle_between_deg(off.plane, plane) == pytest.approx(180.0)


def test_a_plane_needs_points_that_span_it():
    with pytest.raises(BadInput, match="one line"):
        fit_plane(np.outer(np.arange(5.0), [1.0, 2.0, 3.0]), towards=np.ones(3))
    with pytest.raises(BadInput, match="three points"):
        fit_plane([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], towards=np.ones(3))
