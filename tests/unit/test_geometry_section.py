import numpy as np
import pytest
from blocks import block, sphere

from glisson.core import Plane
from glisson.geometry.section import section


def length(segments) -> float:
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum())


@pytest.mark.parametrize("x", [7.3, 10.0])  # between and exactly on the mesh's vertices
def test_a_box_is_cut_along_its_perimeter(x):
    surface = block((3, 2, 2), (30.0, 20.0, 10.0)).surface()
    cut = section(surface, Plane([x, 0.0, 0.0], [1.0, 0.0, 0.0]))
    np.testing.assert_allclose(cut[:, :, 0], x, atol=1e-12)
    assert length(cut) == pytest.approx(60.0, rel=1e-12)


def test_a_sphere_is_cut_along_a_circle():
    surface = sphere([1.0, 2.0, 3.0], 10.0, level=5)
    cut = section(surface, Plane([1.0, 2.0, 9.0], [0.0, 0.0, 1.0]))
    assert length(cut) == pytest.approx(2.0 * np.pi * 8.0, rel=2e-3)


def test_a_plane_that_misses_gives_nothing():
    assert section(sphere([0, 0, 0], 1.0), Plane([0, 0, 5.0], [0, 0, 1.0])).shape == (0, 2, 3)
