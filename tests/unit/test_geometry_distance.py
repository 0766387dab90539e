import numpy as np
import pytest
import trimesh
from blocks import block, sphere

from glisson.core import BadInput, TriangleSurface
from glisson.geometry.distance import SurfaceTree, closest_points, inside

SIZE = np.array([30.0, 20.0, 10.0])


def test_distance_to_a_box_is_the_closed_form():
    surface = block((3, 2, 1), tuple(SIZE)).surface()
    points = np.random.default_rng(2).uniform(-10.0, 40.0, (3000, 3))
    distance, closest = closest_points(points, surface)
    nearest = np.clip(points, 0.0, SIZE)
    outside = np.linalg.norm(points - nearest, axis=1)
    within = np.minimum(points, SIZE - points).min(axis=1)
    np.testing.assert_allclose(distance, np.where(within > 0.0, within, outside), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(points - closest, axis=1), distance, atol=1e-12)


def test_inside_a_box_with_rays_through_its_edges_and_corners():
    surface = block((3, 2, 1), tuple(SIZE)).surface()
    grid = np.stack(np.meshgrid(*[np.arange(-5.0, 36.0, 2.5)] * 3), axis=-1).reshape(-1, 3)  # meets vertices and edges
    clear = np.abs(np.concatenate([grid, grid - SIZE], axis=1)).min(axis=1) > 0.0
    expected = np.all((grid > 0.0) & (grid < SIZE), axis=1)
    assert np.array_equal(inside(grid, surface)[clear], expected[clear])


def test_inside_agrees_with_another_library():
    surface = sphere([1.0, 2.0, 3.0], 10.0, level=3)
    points = np.random.default_rng(3).uniform(-12.0, 15.0, (2000, 3))
    other = trimesh.Trimesh(surface.vertices, surface.triangles, process=False)
    assert np.array_equal(inside(points, surface), other.contains(points))


def test_an_open_surface_has_no_inside():
    with pytest.raises(BadInput, match="closed"):
        inside([[0.0, 0.0, 0.0]], TriangleSurface(np.eye(3), [[0, 1, 2]]))
    with pytest.raises(BadInput, match="without triangles"):
        closest_points([[0.0, 0.0, 0.0]], TriangleSurface(np.eye(3), np.zeros((0, 3))))


@pytest.mark.parametrize(
    "order", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (0, 0, 1), (0, 1, 1), (1, 0, 1), (1, 1, 1)]
)
def test_triangles_without_area_are_segments_or_points(order):
    corners = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    tree = SurfaceTree(corners, np.array([order]))
    points = np.random.default_rng(5).normal(scale=3.0, size=(50, 3))
    low, high = corners[list(order), 0].min(), corners[list(order), 0].max()
    expected = np.stack([np.clip(points[:, 0], low, high), np.zeros(50), np.zeros(50)], axis=1)
    np.testing.assert_allclose(tree.nearest(points).closest_mm, expected, atol=1e-9)


def test_a_tree_that_was_moved_is_as_exact_as_a_new_one():
    surface = sphere([0.0, 0.0, 0.0], 10.0, level=3)
    moved = surface.vertices * [1.0, 2.0, 0.5] + np.sin(surface.vertices[:, ::-1])
    points = np.random.default_rng(8).uniform(-25.0, 25.0, (500, 3))
    found = SurfaceTree(surface.vertices, surface.triangles).moved(moved).nearest(points)
    other = trimesh.Trimesh(moved, surface.triangles, process=False)
    np.testing.assert_allclose(found.distance_mm, trimesh.proximity.closest_point_naive(other, points)[1], atol=1e-9)
