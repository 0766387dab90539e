"""`glisson reconstruct` on sessions of the half-sphere box, and what it refuses."""

import copy

import cv2
import numpy as np
import pytest

from glisson.io.observation_files import read_observations
from glisson.io.photographs import read_photograph
from glisson.phantom.half_sphere_box import LANDMARKS_MM, POSITIONS_DEG
from glisson.phantom.measured_views import measured_views
from view_sessions import NOISE, add_pictures, session_table, write_session

ANGLES = (POSITIONS_DEG[0], POSITIONS_DEG[3])


@pytest.fixture
def table():
    return session_table(measured_views(ANGLES, NOISE, np.random.default_rng(3)))


def errors_mm(said):
    return np.linalg.norm(np.array([mark["point_mm"] for mark in said["landmarks"]]) - LANDMARKS_MM, axis=1)


@pytest.mark.parametrize("technique", ["bundle", "construction"])
def test_a_session_by_hand(tmp_path, table, glisson, technique):
    code, said = glisson("reconstruct", write_session(tmp_path / "s", table), "--technique", technique)
    assert (code, said["status"], said["technique"]) == (0, "converged", technique), said
    # The longest axis is nearly all of the error bar.
    assert (errors_mm(said) < 4.0 * np.array([mark["sigma_mm"][0] for mark in said["landmarks"]])).all()
    assert said["parallax_deg"] == pytest.approx(11.85, abs=1.5)
    written = read_observations(said["observations"])
    assert written.frame == "room"
    assert [item.name for item in written.items if item.kind == "landmark"] == [f"point {n}" for n in range(1, 7)]
    assert read_photograph(said["picture"]).shape[1] == 1440


def test_a_session_from_pictures_alone(tmp_path, table, glisson):
    folder = tmp_path / "s"
    path = write_session(folder, table)
    add_pictures(folder, table, ANGLES)
    for entry in table["views"]:
        del entry["landmarks_px"]
    path = write_session(folder, table)
    code, said = glisson("reconstruct", path, "--out", tmp_path / "seen")
    assert (code, said["tips_found"]) == (0, ["view 1", "view 2"]), said
    assert said["landmarks"] == []
    assert said["surface_points"] > 100
    (surface,) = [item for item in read_observations(said["observations"]).items if item.name == "features"]
    radius = np.linalg.norm(surface.points_mm, axis=1)
    ball = (radius < 43.0) & (surface.points_mm[:, 2] > 5.0)
    assert np.median(np.abs(radius[ball] - 40.0)) < 0.6
    assert (tmp_path / "seen" / "views.png").is_file()
    (folder / "view1.png").replace(folder / "views.png")
    table["views"][0]["image"] = "views.png"
    code, said = glisson("reconstruct", write_session(folder, table))
    assert code == 2
    assert "would be overwritten" in said["message"]
    table["views"][0]["image"] = table["views"][1]["image"]
    code, said = glisson("reconstruct", write_session(folder, table))
    assert code == 2
    assert "view 1 and view 2 have the same picture" in said["message"]


def test_a_direction_without_roll_will_do(tmp_path, table, glisson):
    for entry in table["views"]:
        entry["direction"] = [row[2] for row in entry.pop("rotation")]
        del entry["sigma_roll_deg"]
    code, said = glisson("reconstruct", write_session(tmp_path / "s", table))
    assert code == 0, said
    assert errors_mm(said).max() < 4.0


def _too_close(table):
    table["views"][1]["position_mm"] = table["views"][0]["position_mm"]


def _moved_tip(table):
    table["views"][1]["tip_px"][1] += 60.0


def _nan(table):
    table["views"][1]["rotation"][0][0] = float("nan")


def _no_rotation(table):
    table["views"][0]["rotation"][0] = [1.0, 1.0, 1.0]


def _one_view(table):
    del table["views"][1]


def _no_tip(table):
    del table["views"][0]["tip_px"]


def _once(table):
    del table["views"][0]["landmarks_px"]["point 2"]


def _no_sigma(table):
    table["views"][0]["sigma_position_mm"] = 0.0


def _unknown_key(table):
    table["views"][0]["tip"] = [1.0, 2.0]


def _no_picture(table):
    table["views"][0]["image"] = "nowhere.png"


def _both(table):
    table["views"][0]["direction"] = [0.0, 0.0, 1.0]


def _outside(table):
    table["views"][1]["landmarks_px"]["point 3"] = [5000.0, 100.0]


def _one_name(table):
    table["views"][1]["name"] = table["views"][0]["name"]


@pytest.mark.parametrize(
    ("spoil", "code", "status", "words"),
    [
        (_too_close, 1, "unobservable", "too close to each other"),
        (_nan, 2, "bad_input", "views[1].rotation must be numbers"),
        (_no_rotation, 2, "bad_input", "orthonormal"),
        (_one_view, 2, "bad_input", "at least two views"),
        (_no_tip, 2, "bad_input", "view 1 has neither tip_px nor an image"),
        (_once, 2, "bad_input", "'point 2' must be seen in two or more views"),
        (_no_sigma, 2, "bad_input", "sigma_position_mm must be positive"),
        (_unknown_key, 2, "bad_input", "unknown key 'views[0].tip'"),
        (_no_picture, 2, "bad_input", "nowhere.png"),
        (_both, 2, "bad_input", "views[0].rotation and views[0].direction: give one of the two"),
        (_outside, 2, "bad_input", "view 2: 'point 3' at 5000, 100 px is outside the image of"),
        (_one_name, 2, "bad_input", "Two views have the name 'view 1'"),
    ],
)
def test_bad_sessions_get_a_sentence(tmp_path, table, glisson, spoil, code, status, words):
    spoilt = copy.deepcopy(table)
    spoil(spoilt)
    found, said = glisson("reconstruct", write_session(tmp_path / "s", spoilt))
    assert (found, said["status"]) == (code, status), said
    assert words in said["message"]
    assert said["landmarks"] is None


@pytest.mark.parametrize("technique", ["bundle", "construction"])
def test_a_touched_point_that_moved_is_told_with_a_status(tmp_path, table, glisson, technique):
    _moved_tip(table)
    code, said = glisson("reconstruct", write_session(tmp_path / "s", table), "--technique", technique)
    assert (code, said["status"]) == (1, "ambiguous"), said
    assert any("moved" in note for note in said["notes"])


def test_a_picture_of_another_size_is_refused(tmp_path, table, glisson):
    path = write_session(tmp_path / "s", table)
    cv2.imwrite(str(tmp_path / "s" / "small.png"), np.zeros((10, 20, 3), dtype=np.uint8))
    table["views"][0]["image"] = "small.png"
    path = write_session(tmp_path / "s", table)
    code, said = glisson("reconstruct", path)
    assert code == 2
    assert "20 × 10 px" in said["message"]
    (tmp_path / "s" / "small.png").write_bytes(b"no picture")
    code, said = glisson("reconstruct", path)
    assert code == 2
    assert "no image of a kind that is read" in said["message"]
