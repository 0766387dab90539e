"""Board and lever as CalculiX's elements against the definition of `core.Lever` and closed forms."""

import numpy as np
import pytest

from glisson.core import Lever
from glisson.phantom.calculix.rigid_bodies import board_panels, lever_mesh, turned
from glisson.phantom.truth_checks import gap_to_lever


@pytest.fixture
def lever():
    return Lever.lifting("lever", np.array([3.0, 4.0, 5.0]), np.array([1.0, 0.0, 0.0]), np.array([0.0, -1.0, 0.0]))


def test_surface_is_that_of_the_rounded_bar(lever):
    mesh = lever_mesh(lever)
    surface = mesh.surface()
    assert surface.is_closed
    # A box rounded by r: Steiner's formula on the inner box.
    r = lever.edge_radius_mm
    a, b, c = lever.length_mm - 2 * r, lever.thickness_mm - 2 * r, lever.width_mm - 2 * r
    volume = a * b * c + 2 * r * (a * b + b * c + c * a) + np.pi * r * r * (a + b + c) + 4 / 3 * np.pi * r**3
    assert surface.volume_mm3 == pytest.approx(volume, rel=3e-3)
    assert np.abs(gap_to_lever(surface.vertices, lever, 0.0)).max() < 1e-9


def test_turning_lifts_the_tip(lever):
    tip = lever.hinge_mm + lever.length_mm * lever.arm
    lifted = turned(tip[None], lever, np.deg2rad(30.0))[0]
    np.testing.assert_allclose(lifted, [3.0 + 150.0 * np.cos(np.pi / 6), 4.0 - 75.0, 5.0], atol=1e-9)
    vertices = lever_mesh(lever).surface().vertices
    moved = turned(vertices, lever, np.deg2rad(22.0))
    assert np.abs(gap_to_lever(moved, lever, np.deg2rad(22.0))).max() < 1e-9


def test_gap_is_the_distance(lever):
    above = lever.hinge_mm + 40.0 * lever.arm + 7.0 * lever.up
    assert gap_to_lever(above[None], lever, 0.0)[0] == pytest.approx(7.0)
    within = lever.hinge_mm + 40.0 * lever.arm - 1.5 * lever.up
    assert gap_to_lever(within[None], lever, 0.0)[0] == pytest.approx(-1.5)


def test_board_panels_face_the_organ():
    nodes, bricks = board_panels(np.zeros(3), np.array([0.0, -1.0, 0.0]), 50.0, 2)
    assert nodes[:, 1].min() == 0.0
    assert nodes[:, 1].max() == 10.0
    first, second, fourth, fifth = nodes[bricks[:, [0, 1, 3, 4]].T]
    assert (np.einsum("ij,ij->i", np.cross(second - first, fourth - first), fifth - first) > 0).all()
    np.testing.assert_array_equal(nodes[bricks[:, 4:]][..., 1], 0.0)  # face S2 is nodes 5 to 8
