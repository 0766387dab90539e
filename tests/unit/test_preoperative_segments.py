"""Couinaud's segments from landmarks: against the phantoms' own planes, and against exact blood supply."""

import numpy as np
import pytest

from couinaud_landmarks import (
    clicked,
    dice_of_segments,
    portal_trees,
    supplied_segments,
    true_landmarks,
)
from glisson.core.errors import BadInput
from glisson.core.landmarks import Landmarks
from glisson.core.structures import VesselTree
from glisson.phantom.family import make_phantom
from glisson.preoperative.segments.dividing_planes import DividingPlanes, DividingPlanesParameters
from glisson.preoperative.segments.landmarks import PLACES, landmarks_from_points
from glisson.preoperative.segments.nearest_branch import NearestBranch, NearestBranchParameters
from glisson.preoperative.segments.portal_branches import branch_segments
from glisson.preoperative.segments.resections import resection_volumes

_ON_AXIS = 0.0


@pytest.fixture(scope="module")
def phantom():
    return make_phantom(31, (3.0, 3.0, 3.0))


@pytest.fixture(scope="module")
def landmarks(phantom):
    return true_landmarks(phantom)


@pytest.fixture(scope="module")
def portal(phantom):
    return portal_trees(phantom)


def _planes(phantom, landmarks):
    return DividingPlanes(DividingPlanesParameters(_ON_AXIS)).divide(phantom.organ, (), landmarks)


@pytest.mark.parametrize("member", range(31, 37))
def test_planes_through_exact_landmarks_are_the_phantoms(member):
    """The caudate is the phantom's but for its middle, for which the vena cava's stands."""
    phantom = make_phantom(member, (3.0, 3.0, 3.0))
    exact = Landmarks({name: point[None] for name, point in true_landmarks(phantom).items()})
    dice = dice_of_segments(_planes(phantom, exact).voxels, phantom.couinaud.voxels)
    assert dice[1:].min() >= 0.95
    assert dice[0] >= 0.9


def test_planes_through_clicked_landmarks_are_near_the_phantoms(phantom, landmarks):
    found = _planes(phantom, clicked(landmarks, np.random.default_rng(31)))
    dice = dice_of_segments(found.voxels, phantom.couinaud.voxels)
    assert dice[1:].min() >= 0.85
    assert np.median(dice) >= 0.9


def test_branches_of_the_mask_supply_what_the_exact_branches_do(phantom, landmarks, portal):
    """Found from the mask and clicks; the truth is the nearest branch of the construction, asked of every voxel."""
    given = clicked(landmarks, np.random.default_rng(31))
    found = NearestBranch(NearestBranchParameters(_ON_AXIS)).divide(phantom.organ, portal, given)
    assert np.median(dice_of_segments(found.voxels, supplied_segments(phantom))) >= 0.85


def test_segments_are_the_liver(phantom, landmarks, portal):
    given = Landmarks({name: point[None] for name, point in landmarks.items()})
    found = NearestBranch(NearestBranchParameters()).divide(phantom.organ, portal, given)
    np.testing.assert_array_equal(found.voxels > 0, phantom.organ.mask("liver"))
    volumes = [found.volume_ml(name) for name in found.names.values()]
    assert sum(volumes) == pytest.approx(phantom.organ.volume_ml("liver"), rel=1e-9)
    assert len(resection_volumes(found)) >= 21


def test_the_cut_runs_right_of_the_middle_vein(phantom, landmarks, portal):
    """What lies between the vein's axis and the cut belongs to the left liver: about the plane's area times 5 mm."""
    given = Landmarks({name: point[None] for name, point in landmarks.items()})

    def left_ml(beside):
        found = NearestBranch(NearestBranchParameters(beside)).divide(phantom.organ, portal, given)
        return found.volume_ml("segment 2", "segment 3", "segment 4")

    assert 10.0 < left_ml(5.0) - left_ml(0.0) < 60.0


def _star():
    """A trunk up to the origin with seven straight branches of nine points, and a twig on the first of them."""
    ways = np.array([[np.cos(a), np.sin(a), 0.5] for a in 2.0 * np.pi * np.arange(7) / 7.0])
    points, edges = [np.array([0.0, 0.0, -10.0]), np.zeros(3)], [(0, 1)]
    for way in ways:
        for step in range(1, 10):
            edges.append((1 if step == 1 else len(points) - 1, len(points)))
            points.append(5.0 * step * way)
    edges.append((6, len(points)))
    points.append(points[6] + [0.0, 0.0, 8.0])
    tree = VesselTree("portal", np.array(points), np.ones(len(points)), np.array(edges))
    marks = {f"P{n}": (25.0 * way)[None] for n, way in enumerate(ways, start=2)}
    return tree, {"portal bifurcation": np.zeros((1, 3))} | marks


def test_branches_carry_their_landmarks_number_and_the_trunk_none():
    tree, marks = _star()
    points, numbers = branch_segments((tree,), Landmarks(marks))
    assert len(points) == 7 * 9 + 1
    np.testing.assert_array_equal(np.bincount(numbers), [0, 0, 10, 9, 9, 9, 9, 9, 9])
    assert np.linalg.norm(points, axis=1).min() > 4.0


@pytest.mark.parametrize(
    ("name", "place", "words"),
    [
        ("P4", [300.0, 0.0, 0.0], "'P4' lies .* mm from every portal branch"),
        ("P5", [0.0, 0.0, 0.0], "landmarks P5 lie on the trunk"),
    ],
)
def test_a_landmark_that_slipped_is_refused(name, place, words):
    tree, marks = _star()
    with pytest.raises(BadInput, match=words):
        branch_segments((tree,), Landmarks(marks | {name: np.array([place])}))


def test_missing_and_misnamed_landmarks_are_told(phantom, landmarks):
    known = {name: point[None] for name, point in landmarks.items() if name not in ("MHV", "IVC")}
    with pytest.raises(BadInput, match="lack 'MHV', 'IVC'"):
        _planes(phantom, Landmarks(known))
    with pytest.raises(BadInput, match=r"there is no landmark 'caudate lft' \(perhaps 'caudate left'\)"):
        landmarks_from_points(("P2", "caudate lft"), np.zeros((2, 3)), "marks.mrk.json")


def test_landmarks_at_odds_are_refused(phantom, landmarks):
    swapped = landmarks | {"caudate left": landmarks["caudate right"], "caudate right": landmarks["caudate left"]}
    with pytest.raises(BadInput, match="'caudate left' must lie left of 'caudate right'"):
        _planes(phantom, Landmarks({name: point[None] for name, point in swapped.items()}))
    on_line = landmarks | {"right fissure": 0.5 * (landmarks["RHV"] + landmarks["hepatic confluence"])}
    with pytest.raises(BadInput, match="span no plane"):
        _planes(phantom, Landmarks({name: point[None] for name, point in on_line.items()}))


def test_several_points_of_a_name_are_kept():
    found = landmarks_from_points(("P8", "P8", "P2"), np.arange(9.0).reshape(3, 3), "marks.mrk.json")
    assert {name: len(points) for name, points in found.points_mm.items()} == {"P2": 1, "P8": 2}
    assert set(found.points_mm) <= set(PLACES)
