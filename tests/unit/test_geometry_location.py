import numpy as np
import pytest
from blocks import bent, block, rotation

from glisson.core import BadInput
from glisson.geometry.location import PointLocator
from glisson.geometry.mapping import PointMap

SIZE = (80.0, 30.0, 20.0)


@pytest.fixture
def points():
    return np.random.default_rng(1).uniform(0.0, 1.0, (2000, 3)) * SIZE


@pytest.mark.parametrize("quadratic", [False, True])
def test_affine_maps_are_reproduced_inside_and_outside(points, quadratic):
    mesh = block((8, 3, 2), SIZE)
    mesh = mesh.as_quadratic() if quadratic else mesh
    matrix, shift = rotation([1, 2, 3], 0.7) @ np.diag([1.2, 0.9, 1.05]), np.array([3.0, -7.0, 11.0])
    deformation = PointMap(mesh, mesh.nodes @ matrix.T + shift - mesh.nodes)
    everywhere = np.vstack([points, points * 2.0 - np.array(SIZE) / 2.0])
    there = deformation.forward(everywhere)
    np.testing.assert_allclose(there, everywhere @ matrix.T + shift, atol=1e-10)
    np.testing.assert_allclose(deformation.back(there), everywhere, atol=1e-10)


def test_quadratic_elements_reproduce_quadratic_fields(points):
    mesh = block((4, 2, 2), SIZE).as_quadratic()

    def field(p):
        x, y, z = p.T
        return np.stack([x * y - z**2, 0.3 * x**2 + y - z * x, 1.0 + y**2 - 2.0 * z * y], axis=1)

    locator = PointLocator(mesh)
    values = locator.interpolate(locator.locate(points), field(mesh.nodes))
    np.testing.assert_allclose(values, field(points), rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize("quadratic", [False, True])
def test_there_and_back_on_a_bent_bar(points, quadratic):
    mesh = block((8, 3, 2), SIZE)
    mesh = mesh.as_quadratic() if quadratic else mesh
    deformation = PointMap(mesh, bent(mesh.nodes) - mesh.nodes)
    np.testing.assert_allclose(deformation.back(deformation.forward(points)), points, atol=1e-6)


def test_a_strongly_curved_element_is_located_in_its_curved_shape(points):
    mesh = block((3, 1, 1), SIZE).as_quadratic()
    curved = bent(mesh.nodes, radius=40.0)
    locator, flat = PointLocator(mesh, curved), PointLocator(mesh)
    images = flat.interpolate(flat.locate(points), curved)
    found = locator.locate(images)
    assert found.distance_mm.max() == 0.0
    np.testing.assert_allclose(locator.interpolate(found, mesh.nodes), points, atol=1e-6)


def test_a_point_outside_names_the_nearest_element_and_its_distance():
    mesh = block((4, 2, 2), SIZE)
    found = PointLocator(mesh).locate([[-5.0, 4.0, 4.0], [83.0, 34.0, 10.0], [40.0, 10.0, 5.0]])
    np.testing.assert_allclose(found.distance_mm, [5.0, 5.0, 0.0], atol=1e-12)
    assert mesh.nodes[mesh.corners[found.elements[0]]][:, 0].max() <= 20.0
    assert found.coordinates[:2].min(axis=1).max() < 0.0
    np.testing.assert_allclose(found.coordinates.sum(axis=1), 1.0)


def test_a_quadratic_field_goes_on_linearly_outside():
    mesh = block((2, 1, 1), (20.0, 10.0, 10.0)).as_quadratic()
    locator = PointLocator(mesh)
    outside = np.array([[25.0, 5.0, 5.0], [30.0, 5.0, 5.0], [40.0, 5.0, 5.0]])
    values = locator.interpolate(locator.locate(outside), mesh.nodes[:, :1] ** 2)[:, 0]
    assert np.isfinite(values).all()
    steps = np.diff(values) / np.diff(outside[:, 0])
    assert np.all(np.abs(steps - 40.0) < 12.0)  # the slope of x² at the face x = 20


def test_displacements_of_another_mesh_are_refused():
    mesh = block((1, 1, 1), (1.0, 1.0, 1.0))
    with pytest.raises(BadInput, match="8 nodes"):
        PointMap(mesh, np.zeros((9, 3)))
    with pytest.raises(BadInput, match="8 nodes"):
        PointLocator(mesh, np.zeros((9, 3)))
