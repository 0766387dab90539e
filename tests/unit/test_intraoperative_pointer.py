"""The tip as a pointer and a pen, against closed forms and drawn noise."""

import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.core.status import Status
from glisson.core.tip_track import TipTrack
from glisson.core.transform import RigidTransform
from glisson.intraoperative.pointer.measuring import as_observation, distance, pointed_at, stroke_length
from glisson.intraoperative.pointer.resection import plane_of, surface_of
from glisson.intraoperative.pointer.smoothing import smoothed

RNG = np.random.default_rng(5)


def track(points: np.ndarray, sigma_mm: float = 0.5, dt: float = 0.04) -> TipTrack:
    points = np.asarray(points, dtype=float)
    covariance = np.broadcast_to(sigma_mm**2 * np.eye(3), (len(points), 3, 3))
    return TipTrack("pointer", "trocar", np.arange(len(points)) * dt, points, covariance)


def circle(radius_mm: float, count: int = 200) -> np.ndarray:
    angles = np.linspace(0.0, np.pi, count)
    return radius_mm * np.stack([np.cos(angles), np.sin(angles), np.zeros(count)], axis=1)


def test_smoothing_errs_as_it_says_where_a_hand_moves_as_it_is_told():
    ratios, before, after = [], [], []
    for _ in range(30):
        speeds = np.cumsum(40.0 * np.sqrt(0.04) * RNG.standard_normal((200, 3)), axis=0)
        true = np.cumsum(0.04 * speeds, axis=0)
        noisy = true + 0.5 * RNG.standard_normal(true.shape)
        found = smoothed(track(noisy))
        off = found.points_mm - true
        ratios.append(np.einsum("ni,nij,nj->n", off, np.linalg.inv(found.covariance_mm2), off))
        before.append(np.linalg.norm(noisy - true, axis=1))
        after.append(np.linalg.norm(off, axis=1))
    assert np.mean(ratios) == pytest.approx(3.0, rel=0.1)
    assert np.mean(after) < 0.7 * np.mean(before)


def test_a_point_is_no_surer_than_one_place_and_spread_is_added():
    rest = track(np.tile([1.0, 2.0, 3.0], (50, 1)))
    found = pointed_at(rest)
    assert np.allclose(found.point_mm, [1.0, 2.0, 3.0])
    assert np.allclose(found.covariance_mm2, 0.25 * np.eye(3))
    moving = pointed_at(track([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]))
    assert np.allclose(moving.covariance_mm2, 0.25 * np.eye(3) + np.diag([0.5, 0.0, 0.0]))


def test_distances_and_lengths_as_by_hand():
    one, other = pointed_at(track([[0.0, 0.0, 0.0]])), pointed_at(track([[30.0, 40.0, 0.0]]))
    found = distance(one, other)
    assert found.mm == pytest.approx(50.0)
    assert found.sigma_mm == pytest.approx(0.5 * np.sqrt(2.0))
    # On a straight way only the ends count.
    straight = stroke_length(track(np.linspace([0.0, 0.0, 0.0], [20.0, 0.0, 0.0], 50)))
    assert straight.mm == pytest.approx(20.0)
    assert straight.sigma_mm == pytest.approx(0.5 * np.sqrt(2.0))
    assert stroke_length(track(circle(30.0))).mm == pytest.approx(30.0 * np.pi, rel=1e-3)


def test_a_moved_track_carries_the_error_of_the_transform():
    covariance = np.diag([1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0])
    room_from_trocar = RigidTransform("room", "trocar", np.eye(3), [5.0, 0.0, 0.0], covariance)
    there = track([[0.0, 0.0, 100.0]]).moved(room_from_trocar)
    assert there.frame == "room"
    assert np.allclose(there.points_mm, [[5.0, 0.0, 100.0]])
    # A turn by 0.01 rad moves what is 100 mm away by 1 mm, across only.
    assert np.allclose(there.covariance_mm2, np.diag([1.25, 1.25, 0.25]))
    with pytest.raises(BadInput, match="from there"):
        there.moved(room_from_trocar)


def test_the_plane_of_a_line_errs_as_it_says():
    normal = np.array([0.6, 0.0, 0.8])
    arc = circle(40.0) @ np.stack([np.cross([0.0, 1.0, 0.0], normal), [0.0, 1.0, 0.0], normal])
    tilts, predicted = [], []
    for _ in range(300):
        found = plane_of(track(arc + 0.5 * RNG.standard_normal(arc.shape)), normal)
        tilts.append(np.arccos(min(found.plane.normal @ normal, 1.0)))
        predicted.append(np.trace(found.covariance[:2, :2]))
        assert found.rms_mm == pytest.approx(0.5, rel=0.3)
    assert np.mean(np.square(tilts)) == pytest.approx(np.mean(predicted), rel=0.15)
    assert found.covariance[2, 2] > 0.25


def test_a_side_must_be_told_and_a_tilt_be_known():
    for nowhere in ([0.0, 0.0, 0.0], [1.0, 0.0, 0.05]):
        with pytest.raises(BadInput, match="the removed side"):
            plane_of(track(circle(40.0)), np.array(nowhere))
    assert plane_of(track(circle(40.0)), np.array([1.0, 0.0, 0.3])).status is Status.CONVERGED
    line = np.linspace([0.0, 0.0, 0.0], [30.0, 0.0, 0.0], 50) + 0.3 * RNG.standard_normal((50, 3))
    assert plane_of(track(line), np.array([0.0, 0.0, 1.0])).status is Status.UNOBSERVABLE


def test_tips_that_are_seen_badly_count_less():
    arc = circle(40.0)
    arc[::4, 2] = 5.0
    covariance = np.broadcast_to(0.01 * np.eye(3), (len(arc), 3, 3)).copy()
    covariance[::4] = 1e4 * np.eye(3)
    line = TipTrack("pointer", "trocar", np.arange(len(arc)) * 0.04, arc, covariance)
    assert plane_of(line, np.array([0.0, 0.0, 1.0])).plane.distance_mm([[0.0, 0.0, 0.0]]) == pytest.approx(
        0.0, abs=1e-3
    )


def test_a_straight_line_spans_no_plane():
    with pytest.raises(BadInput, match="one line"):
        plane_of(track(np.linspace([0.0, 0.0, 0.0], [20.0, 0.0, 0.0], 50)), np.array([0.0, 0.0, 1.0]))


def test_the_ruled_surface_goes_straight_in():
    surface = surface_of(track(circle(30.0)), np.array([0.0, 0.0, -2.0]), 50.0)
    corners = surface.vertices[surface.triangles]
    sides = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert 0.5 * np.linalg.norm(sides, axis=1).sum() == pytest.approx(50.0 * 30.0 * np.pi, rel=1e-3)
    assert surface.vertices[:, 2].min() == pytest.approx(-50.0)
    with pytest.raises(BadInput, match="depth"):
        surface_of(track(circle(30.0)), np.array([0.0, 0.0, 1.0]), 0.0)


def test_a_stroke_is_an_observation_with_covariance():
    seen = as_observation(track(circle(30.0)), "surface", "edge")
    assert (seen.kind, seen.frame, seen.sigma_mm) == ("surface", "trocar", pytest.approx(0.5))
    assert seen.covariance_mm2.shape == (200, 3, 3)
    with pytest.raises(BadInput, match="not seen"):
        as_observation(track(circle(30.0)).between(100.0, 200.0), "surface", "edge")


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"times_s": [0.0, 0.0]}, "grow"),
        ({"frame": "moon"}, "frame"),
        ({"covariance_mm2": np.zeros((2, 3, 3))}, "definite"),
        ({"points_mm": [[0.0, 0.0, np.nan], [0.0, 0.0, 0.0]]}, "not finite"),
    ],
)
def test_tracks_that_cannot_be(change, sentence):
    good = {"times_s": [0.0, 1.0], "frame": "trocar", "points_mm": np.zeros((2, 3)), "covariance_mm2": [np.eye(3)] * 2}
    with pytest.raises(BadInput, match=sentence):
        TipTrack("pointer", **(good | change))
