"""The lattice cut at a level: it fills space, follows the level, and has no sliver."""

import numpy as np
import pytest

from glisson.core.mesh import TetMesh, signed_volumes
from glisson.preoperative.meshing.lattice import body_centred_lattice, inside_of_level
from glisson.preoperative.meshing.mesh_quality import smallest_dihedral_angles_deg

LOW, HIGH = np.array([-20.0, -10.0, -15.0]), np.array([20.0, 10.0, 15.0])


def test_the_lattice_covers_the_box_once_with_one_shape_of_element():
    nodes, tetrahedra = body_centred_lattice(LOW, HIGH, 4.0)
    volumes = np.abs(signed_volumes(nodes, tetrahedra))
    np.testing.assert_allclose(volumes, 4.0**3 / 12.0)
    np.testing.assert_allclose(smallest_dihedral_angles_deg(nodes, tetrahedra), 60.0)
    used = nodes[np.unique(tetrahedra)]
    assert (used.min(axis=0) < LOW).all()
    assert (used.max(axis=0) > HIGH).all()


@pytest.mark.parametrize("normal", [(1.0, 0.0, 0.0), (0.3, -0.5, 0.8), (1.0, 1.0, 1.0)])
def test_a_half_space_is_cut_exactly(normal):
    """A linear level is met exactly: the pieces and those of the other side fill the lattice."""
    nodes, tetrahedra = body_centred_lattice(LOW, HIGH, 5.0)
    level = (nodes - [0.7, 0.4, -0.2]) @ np.asarray(normal) / np.linalg.norm(normal)
    total = np.abs(signed_volumes(nodes, tetrahedra)).sum()
    sides = []
    for sign in (1.0, -1.0):
        found, pieces = inside_of_level(nodes, tetrahedra, sign * level)
        volumes = signed_volumes(found, pieces)
        assert volumes.min() > 0.0
        heights = sign * (found[np.unique(pieces)] - [0.7, 0.4, -0.2]) @ np.asarray(normal) / np.linalg.norm(normal)
        assert heights.max() < 1e-9
        sides.append(volumes.sum())
    # At the lattice's rim nodes that moved onto the plane carry the rim along.
    assert sum(sides) == pytest.approx(total, rel=0.02)


def test_a_ball_is_conforming_without_slivers_and_of_second_order():
    errors = []
    for spacing in (6.0, 3.0, 1.5):
        nodes, tetrahedra = body_centred_lattice(np.full(3, -20.0), np.full(3, 20.0), spacing)
        found, pieces = inside_of_level(nodes, tetrahedra, np.linalg.norm(nodes - [0.3, 0.1, 0.2], axis=1) - 20.0)
        assert smallest_dihedral_angles_deg(found, pieces).min() > 7.0
        mesh = TetMesh(found, pieces)
        assert mesh.surface().is_closed  # a face split in two ways would leave holes
        errors.append(abs(mesh.volume_mm3 / (4.0 / 3.0 * np.pi * 20.0**3) - 1.0))
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert (np.abs(orders - 2.0) < 0.35).all()
