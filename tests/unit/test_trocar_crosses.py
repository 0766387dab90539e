"""Crosses are told apart turned, mirrored and with one square misread; layouts and rooms in files."""

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import trocar_views
from glisson.core import BadInput
from glisson.core.crosses import Cross, CrossLayout
from glisson.core.transform import RigidTransform
from glisson.intraoperative.trocar.codes import cross_codes
from glisson.io.layout_files import read_layout, write_layout
from glisson.io.recommended import recommended_camera, recommended_layout, recommended_room
from glisson.io.room_files import read_room


def seen_as(code):
    """All a camera may read, straight or in a mirror, by turning a drawing of the cross."""
    picture = np.full((3, 3), "", dtype=object)
    picture[1, 1], picture[1, 2], picture[2, 1], picture[1, 0], picture[0, 1] = code
    turned = [np.rot90(picture, k) for k in range(4)]
    return [tuple(one[[1, 1, 2, 1, 0], [1, 2, 1, 0, 1]]) for one in turned + [one[:, ::-1] for one in turned]]


def test_codes_differ_in_two_squares_however_they_are_seen():
    codes = cross_codes()
    assert len(codes) == 15
    for code in codes:
        assert min(sum(a != b for a, b in zip(code, other, strict=True)) for other in seen_as(code)[1:]) >= 2
    for one, other in combinations(codes, 2):
        assert min(sum(a != b for a, b in zip(one, seen, strict=True)) for seen in seen_as(other)) >= 2


def test_a_layout_is_as_it_was_written(tmp_path):
    layout = trocar_views.layout()
    write_layout(tmp_path / "layout.toml", layout)
    read = read_layout(tmp_path / "layout.toml")
    for one, other in zip(layout.crosses, read.crosses, strict=True):
        assert (one.name, one.colours, one.size_mm) == (other.name, tuple(other.colours), other.size_mm)
        assert np.allclose(one.corners_mm, other.corners_mm, atol=1e-9)


def test_what_may_be_mistaken_is_refused():
    pose = RigidTransform("room", "cross", np.eye(3), np.zeros(3))
    good = Cross("a", ("red", "red", "yellow", "green", "blue"), 300.0, pose)
    turned = Cross("b", ("red", "blue", "red", "yellow", "green"), 300.0, pose)
    mirrored = Cross("c", ("red", "red", "blue", "green", "yellow"), 300.0, pose)
    for other in (turned, mirrored):
        with pytest.raises(BadInput, match="look the same"):
            CrossLayout((good, other))
    with pytest.raises(BadInput, match="turned or mirrored"):
        CrossLayout((Cross("d", ("red", "red", "blue", "red", "green"), 300.0, pose),))
    with pytest.raises(BadInput, match="five colours"):
        Cross("e", ("red", "pink", "blue", "red", "green"), 300.0, pose)
    with pytest.raises(BadInput, match="size"):
        Cross("f", good.colours, -1.0, pose)
    with pytest.raises(BadInput, match="same name"):
        CrossLayout((good, Cross("a", ("red", "red", "yellow", "blue", "yellow"), 300.0, pose)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("colours", '["red"]'), "five colours"),
        (("down", "[1.0, 0.0, 0.0]"), "perpendicular"),
        (("right", "[nan, 0.0, 0.0]"), "right"),
        (("size_mm", '"large"'), "size_mm"),
        (("colour", "1"), "unknown key"),
    ],
)
def test_bad_layout_files(tmp_path, change, words):
    entries = {
        "name": '"a"', "colours": '["red", "red", "yellow", "green", "blue"]', "size_mm": "300.0",
        "centre_mm": "[0.0, 0.0, 2900.0]", "right": "[1.0, 0.0, 0.0]", "down": "[0.0, 1.0, 0.0]",
    } | dict([change])  # fmt: skip
    text = "schema = 1\n[[crosses]]\n" + "\n".join(f"{key} = {value}" for key, value in entries.items())
    (tmp_path / "layout.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadInput, match=words):
        read_layout(tmp_path / "layout.toml")


def test_an_area_that_faces_outwards_is_refused(tmp_path):
    (tmp_path / "room.toml").write_text(
        "schema = 1\nsize_mm = [5000.0, 4000.0, 2800.0]\n[trocar]\nlow_mm = [-1.0, -1.0, 1000.0]\n"
        "high_mm = [1.0, 1.0, 1100.0]\ntilt_deg = 20\n[[areas]]\nname = 'ceiling'\ncentre_mm = [0.0, 0.0, 2800.0]\n"
        "right = [1.0, 0.0, 0.0]\ndown = [0.0, -1.0, 0.0]\nwidth_mm = 3000\nheight_mm = 3000\n",
        encoding="utf-8",
    )
    with pytest.raises(BadInput, match="outwards"):
        read_room(tmp_path / "room.toml")


def test_drawn_poses_stay_in_the_region_and_lean_evenly():
    rng = np.random.default_rng(3)
    poses = [trocar_views.ROOM.draw_pose(rng) for _ in range(4000)]
    places = np.array([one.translation_mm for one in poses])
    assert (places >= trocar_views.ROOM.trocar_low_mm).all()
    assert (places <= trocar_views.ROOM.trocar_high_mm).all()
    # Evenly over the cap: the cosine of the lean is uniform.
    cosines = np.array([one.rotation[2, 2] for one in poses])
    lowest = np.cos(trocar_views.ROOM.tilt_rad)
    assert cosines.min() >= lowest - 1e-9
    assert cosines.mean() == pytest.approx(0.5 * (1.0 + lowest), abs=4.0 * (1.0 - lowest) / np.sqrt(12.0 * 4000))
    assert Rotation.from_matrix(poses[0].rotation).magnitude() > 0.0


def test_the_recommended_crosses_hang_in_the_recommended_room():
    room, layout = recommended_room(), recommended_layout()
    assert len(layout) == 15
    assert recommended_camera().width == 1280
    half = room.size_mm / 2.0 * [1.0, 1.0, 2.0]
    for cross in layout.crosses:
        assert (np.abs(cross.corners_mm) <= half + 1e-6).all()
