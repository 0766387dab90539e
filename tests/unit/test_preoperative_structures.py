import numpy as np
import pytest
from scipy.spatial import cKDTree

from glisson.core import Grid, LabelMap
from glisson.preoperative.model.structures import build_structures
from glisson.preoperative.vessels.centrelines import centreline_trees
from preoperative_shapes import ellipsoid, labels_of, mask_of

GRID = Grid((120, 60, 50), [1.0, 1.0, 1.6], [-60.0, -30.0, -40.0])


def tube(line: np.ndarray, radius: float):
    tree = cKDTree(line)
    return lambda points: tree.query(points)[0] < radius


def straight(start, end, count: int = 400) -> np.ndarray:
    return np.linspace(start, end, count)


@pytest.mark.parametrize("radius", [2.0, 4.0, 7.0])
def test_radius_of_a_straight_tube(radius):
    line = straight([-45.0, -6.0, -20.0], [45.0, 8.0, 10.0])
    (tree,) = centreline_trees(mask_of(tube(line, radius), GRID), GRID)
    assert np.median(tree.radii_mm) == pytest.approx(radius, abs=0.15)
    # Away from the tube's round ends, the line lies in the middle to a good half of a voxel.
    inner = np.abs(tree.points_mm[:, 0]) < 45.0 - radius
    distance, _ = cKDTree(line).query(tree.points_mm[inner])
    assert np.percentile(distance, 95) < 0.8
    assert len(np.unique(tree.edges[:, 1])) == len(tree.points_mm) - 1


def test_a_fork_is_one_tree_from_its_thick_end_with_one_branching():
    trunk = straight([-50.0, 0.0, 0.0], [0.0, 0.0, 0.0])
    arms = [straight([0.0, 0.0, 0.0], end) for end in ([45.0, 18.0, 10.0], [45.0, -18.0, -10.0])]

    def inside(points):
        return tube(trunk, 5.0)(points) | tube(arms[0], 3.0)(points) | tube(arms[1], 3.0)(points)

    (tree,) = centreline_trees(mask_of(inside, GRID), GRID)
    degree = np.bincount(tree.edges.ravel(), minlength=len(tree.points_mm))
    assert (degree == 1).sum() == 3
    assert (degree == 3).sum() == 1
    assert tree.points_mm[0] == pytest.approx([-50.0, 0.0, 0.0], abs=6.0)
    assert tree.points_mm[degree == 3][0] == pytest.approx([0.0, 0.0, 0.0], abs=5.0)
    assert tree.length_mm == pytest.approx(50.0 + 2.0 * np.linalg.norm([45.0, 18.0, 10.0]), rel=0.06)


def test_bumps_of_a_tube_give_no_spurs():
    line = straight([-45.0, 0.0, 0.0], [45.0, 0.0, 0.0])
    bumps = [np.array([x, 4.0, 2.0]) for x in (-25.0, 0.0, 25.0)]

    def inside(points):
        bumpy = [np.linalg.norm(points - bump, axis=1) < 3.0 for bump in bumps]
        return tube(line, 5.0)(points) | np.any(bumpy, axis=0)

    (tree,) = centreline_trees(mask_of(inside, GRID), GRID)
    assert np.bincount(tree.edges.ravel()).max() == 2


ORGAN = ellipsoid((0.0, 0.0, 0.0), (58.0, 28.0, 36.0))
BEND = 30.0
ANGLES = np.linspace(0.0, 1.8, 500)
DUCT = np.stack([-20.0 + BEND * np.sin(ANGLES), 0.0 * ANGLES, BEND * (1.0 - np.cos(ANGLES)) - 20.0], axis=1)
"""An arc of radius 30 mm and 1.8 rad: 54 mm long, its mouth at (−20, 0, −20)."""


def structures_of(**tubes: np.ndarray) -> LabelMap:
    voxels = np.zeros(GRID.shape, dtype=np.uint8)
    for number, (name, line) in enumerate(tubes.items(), start=1):
        voxels[mask_of(tube(line, 1.3 if name == "wire" else 2.5), GRID)] = number
    return LabelMap(voxels, GRID, dict(enumerate(tubes, start=1)))


@pytest.mark.parametrize("others", [{}, {"portal": straight([-50.0, 5.0, -22.0], [-25.0, 5.0, -22.0])}])
def test_duct_runs_inward_from_its_mouth_and_holds_the_wire(others):
    reach = ANGLES < 1.2
    structures = structures_of(**others, duct=DUCT, wire=DUCT[reach])
    found = build_structures(labels_of("liver", ORGAN, GRID), None, structures)
    assert found.duct is not None
    inward = found.duct.points_mm
    if others:
        assert np.linalg.norm(inward[0] - DUCT[0]) < 3.5
        assert np.linalg.norm(inward[-1] - DUCT[-1]) < 3.5
        # The wire has 1.2 of 1.8 rad, and half a millimetre more where its round end is.
        assert found.wire_length_mm == pytest.approx(1.2 * BEND + 2.5, abs=2.0)
    assert found.duct.length_mm == pytest.approx(1.8 * BEND + 2 * 2.5, rel=0.03)
    distance, _ = cKDTree(DUCT).query(inward[3:-3])
    assert distance.max() < 0.7


def test_direction_along_the_duct_is_good_to_two_degrees():
    structures = structures_of(portal=straight([-50.0, 5.0, -22.0], [-25.0, 5.0, -22.0]), duct=DUCT)
    duct = build_structures(labels_of("liver", ORGAN, GRID), None, structures).duct
    assert duct is not None
    middle = duct.points_mm[8:-8]
    tangent = middle[2:] - middle[:-2]
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    _, nearest = cKDTree(DUCT).query(middle[1:-1])
    exact = np.gradient(DUCT, axis=0)[nearest]
    exact /= np.linalg.norm(exact, axis=1, keepdims=True)
    angles = np.degrees(np.arccos(np.clip((tangent * exact).sum(axis=1), -1.0, 1.0)))
    assert np.median(angles) < 2.0
    assert angles.max() < 5.0


def test_without_a_wire_the_whole_duct_counts_and_without_a_duct_the_wire():
    organ = labels_of("liver", ORGAN, GRID)
    duct = build_structures(organ, None, structures_of(duct=DUCT))
    assert duct.duct is not None
    assert duct.wire_length_mm == duct.duct.length_mm
    wire = build_structures(organ, None, structures_of(wire=DUCT))
    assert wire.duct is not None
    assert wire.duct.length_mm == pytest.approx(1.8 * BEND + 2.6, rel=0.03)
    nothing = build_structures(organ, None, structures_of(gallbladder=DUCT))
    assert nothing.duct is None
    assert nothing.wire_length_mm is None
    assert nothing.trees == ()


def test_vessels_end_near_the_organ_and_pieces_are_named():
    pieces = np.vstack([straight([-100.0, 0.0, 0.0], [-5.0, 0.0, 0.0]), straight([10.0, 0.0, 0.0], [40.0, 0.0, 0.0])])
    found = build_structures(labels_of("liver", ORGAN, GRID), None, structures_of(portal=pieces))
    assert [tree.name for tree in found.trees] == ["portal", "portal 2"]
    assert found.trees[0].points_mm[:, 0].min() > -58.0 - 4.0


def test_tumours_keep_volume_and_centroid():
    centre = np.array([10.0, 3.0, -4.0])
    labels = labels_of("tumour1", ellipsoid(tuple(centre), (11.0, 9.0, 10.0)), GRID)
    (tumour,) = build_structures(labels_of("liver", ORGAN, GRID), labels, None).tumours
    assert tumour.name == "tumour1"
    assert tumour.volume_mm3 == pytest.approx(4.0 / 3.0 * np.pi * 990.0, rel=0.01)
    np.testing.assert_allclose(tumour.centroid_mm, centre, atol=0.1)
