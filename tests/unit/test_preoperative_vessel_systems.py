"""Vessel systems told apart, against trees whose systems are known."""

import numpy as np
import pytest

from glisson.core import BadInput, Grid, LabelMap, Volume
from glisson.core.structures import VesselTree
from glisson.phantom.canvas import Canvas, voxel_places
from glisson.preoperative.vessels.contrast import require_contrast
from glisson.preoperative.vessels.skeleton import FREE, skeleton_pieces
from glisson.preoperative.vessels.systems import given_systems, split_systems

GRID = Grid((90, 80, 70), [1.0, 1.0, 1.0], [0.0, 0.0, 0.0])


def painted(*tubes):
    """Mask of straight tubes (start, end, radius, radius)."""
    mask = np.zeros(GRID.shape, dtype=bool)
    canvas = Canvas(GRID, np.zeros(GRID.shape, dtype=np.float32), voxel_places(GRID), 0.0)
    for start, end, first, last in tubes:
        tree = VesselTree("tube", np.array([start, end], dtype=float), [first, last], [[0, 1]])
        mask |= canvas.paint_tree(tree, 1.0)
    return mask


def liver():
    organ = np.zeros(GRID.shape, dtype=np.uint8)
    organ[2:-2, 2:-2, 2:-2] = 1
    return LabelMap(organ, GRID, {1: "liver"})


PORTAL = (((10, 40, 20), (80, 40, 20), 3.0, 2.2), ((40, 40, 20), (55, 65, 40), 2.0, 1.6))
HEPATIC = (((45, 10, 60), (45, 40, 22), 3.0, 2.6), ((45, 40, 22), (45, 60, -1), 2.4, 2.0))
CLICKS = {"portal": np.array([[10.0, 40.0, 20.0]]), "hepatic": np.array([[45.0, 10.0, 60.0]])}


def test_pieces_of_a_fork():
    pieces = skeleton_pieces(painted(*PORTAL), GRID)
    # The step of a voxel from each piece to the next belongs to neither.
    length = sum(piece.length_mm + 1.0 for piece in pieces)
    assert length == pytest.approx(70.0 + np.linalg.norm([15, 25, 20]), abs=10.0)
    ends = [piece.points_mm[-end] for piece in pieces for end in (0, 1) if piece.sites[end] == FREE]
    assert len(ends) == 3
    for tip in ([10, 40, 20], [80, 40, 20], [55, 65, 40]):
        assert min(np.linalg.norm(end - tip) for end in ends) < 5.0
    meeting = np.bincount([site for piece in pieces for site in piece.sites if site != FREE])
    assert sorted(meeting[meeting > 0])[-2:] == [2, 3]


def test_vessels_that_cross_are_told_apart():
    portal, hepatic = painted(*PORTAL), painted(*HEPATIC)
    found = split_systems(portal | hepatic, liver(), CLICKS)
    for name, mask, other in (("portal", portal, hepatic), ("hepatic", hepatic, portal)):
        only = mask & ~other
        assert (found.labels.mask(name) & only).sum() > 0.95 * only.sum()
        tree = next(tree for tree in found.trees if tree.name == name)
        assert np.linalg.norm(tree.points_mm[0] - CLICKS[name]) < 5.0
        assert np.median(tree.radii_mm) == pytest.approx(2.3, abs=0.6)
    assert ["touch" in note for note in found.notes] == [True]


def test_a_tree_has_its_root_first_and_no_loop():
    found = split_systems(painted(*PORTAL) | painted(*HEPATIC), liver(), CLICKS)
    for tree in found.trees:
        assert len(tree.edges) == len(tree.points_mm) - 1
        assert sorted(tree.edges[:, 1]) == list(range(1, len(tree.points_mm)))
        assert (tree.edges[:, 0] < tree.edges[:, 1]).all()


def test_what_no_system_reaches_is_said():
    lone = painted(((10, 70, 60), (30, 70, 60), 2.0, 2.0))
    found = split_systems(painted(*PORTAL) | painted(*HEPATIC) | lone, liver(), CLICKS)
    assert (found.labels.mask("vessels") & lone).sum() > 0.9 * lone.sum()


def test_a_gap_is_bridged():
    whole = painted(((10, 40, 20), (80, 40, 20), 2.5, 2.5))
    whole[40:44] = False
    found = split_systems(whole | painted(((45, 10, 60), (45, 35, 60), 2.5, 2.5)), liver(), CLICKS)
    assert (found.labels.mask("portal") & whole).sum() > 0.98 * whole.sum()
    assert found.trees[0].length_mm == pytest.approx(70.0, abs=8.0)


def test_given_systems_keep_their_labels():
    portal, hepatic = painted(*PORTAL), painted(*HEPATIC)
    given = LabelMap(np.where(portal, 2, 7 * hepatic).astype(np.uint8), GRID, {2: "portal", 7: "hepatic"})
    found = given_systems(given, liver(), CLICKS)
    for name in ("portal", "hepatic"):
        assert (found.labels.mask(name) == given.mask(name)).all()
        assert any(tree.name == name for tree in found.trees)


def test_a_click_far_from_all_vessels_is_refused():
    with pytest.raises(BadInput, match="nearest vessel"):
        split_systems(painted(*PORTAL), liver(), CLICKS | {"hepatic": np.array([[5.0, 5.0, 5.0]])})


def test_roots_that_are_guessed_are_said_to_be():
    thin = painted(((10, 40, 20), (80, 40, 20), 1.5, 1.5))
    notes = split_systems(thin, liver(), {}).notes
    assert sum("guess" in note for note in notes) == 2


def test_vessels_that_do_not_stand_out_are_refused():
    organ, random = liver(), np.random.default_rng(3)
    vessels = painted(*PORTAL) | painted(*HEPATIC)
    noise = 12.0 * random.standard_normal(GRID.shape)
    require_contrast(Volume((100.0 + 60.0 * vessels + noise).astype(np.float32), GRID), organ, vessels)
    with pytest.raises(BadInput, match="contrast agent"):
        require_contrast(Volume((55.0 - 10.0 * vessels + noise).astype(np.float32), GRID), organ, vessels)
    with pytest.raises(BadInput, match="contrast agent"):
        require_contrast(Volume((100.0 + noise).astype(np.float32), GRID), organ, np.zeros_like(vessels))
