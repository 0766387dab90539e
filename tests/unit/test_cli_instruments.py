"""`glisson instruments`, `pointer` and `markers`, from files to files."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.core.transform import RigidTransform
from glisson.io.instrument_files import EXAMPLE_LIBRARY, EXAMPLE_TROCAR, read_instruments, read_trocar
from glisson.io.observation_files import read_observations
from glisson.io.photographs import read_photograph, write_photograph
from glisson.io.surfaces import read_surface
from glisson.io.tip_files import read_tips
from glisson.io.video import write_video
from glisson.phantom.wheel_scene import WheelScene, draw_scene
from glisson.phantom.wheel_view import WheelViews

Glisson = Callable[..., tuple[int, dict[str, Any]]]
TROCAR, LIBRARY = read_trocar(EXAMPLE_TROCAR), read_instruments(EXAMPLE_LIBRARY)


@pytest.fixture(scope="module")
def views() -> WheelViews:
    return WheelViews(TROCAR.camera)


def scene_of(name: str) -> WheelScene:
    drawn = draw_scene(TROCAR, [LIBRARY.named(name)], np.random.default_rng(4), distance_mm=(100.0, 120.0))
    return replace(drawn, fingers=(), blood=(), glare=())


def test_a_library_is_made_listed_and_checked(tmp_path: Path, glisson: Glisson) -> None:
    path = tmp_path / "instruments.toml"
    code, said = glisson("instruments", "add", "hook", "--length-mm", "330", "--library", path)
    assert code == 0, said
    colours = ",".join(said["instrument"]["colours"])
    code, said = glisson("instruments", "add", "twin", "--length-mm", "330", "--library", path, "--colours", colours)
    assert (code, said["status"]) == (2, "bad_input")
    assert "differs from that of 'twin' in 0 sectors" in said["message"]
    _, said = glisson("instruments", "list", "--library", path)
    assert [row["name"] for row in said["instruments"]] == ["hook"]
    assert glisson("instruments", "check", "--library", path)[0] == 0
    hook = path.read_text(encoding="utf-8")
    path.write_text(hook + hook.replace("schema = 1", "").replace("hook", "twin"), encoding="utf-8")
    code, said = glisson("instruments", "check", "--library", path)
    assert code == 1
    assert "'twin'" in said["alike"][0]


def test_the_instrument_of_a_picture(tmp_path: Path, glisson: Glisson, views: WheelViews) -> None:
    scene = scene_of("scissors")
    write_photograph(tmp_path / "view.png", views.view(scene))
    code, said = glisson("instruments", "recognise", tmp_path / "view.png", "--trocar", EXAMPLE_TROCAR)
    assert code == 0, said
    assert said["instrument"] == "scissors"
    true = scene.trocar_from_instrument.apply(scene.instrument.tip_mm)
    assert np.linalg.norm(np.array(said["tip_mm"]) - true) < 4.0 * np.sqrt(np.trace(said["tip_covariance_mm2"]))
    assert said["room"] is None
    assert read_photograph(said["picture"]).shape == (960 + 64, 1280, 3)
    assert glisson("instruments", "add", "hook", "--library", tmp_path / "one.toml", "--length-mm", "330")[0] == 0
    words = ["instruments", "recognise", tmp_path / "view.png", "--trocar", EXAMPLE_TROCAR]
    code, said = glisson(*words, "--library", tmp_path / "one.toml")
    assert (code, said["status"]) == (2, "bad_input"), said
    for place, sentence in (("view.png", "would be overwritten"), ("seen.jpg", "ends in .png")):
        code, said = glisson(*words, "--out", tmp_path / place)
        assert code == 2
        assert sentence in said["message"]
    assert read_photograph(tmp_path / "view.png").shape == (960, 1280, 3)


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["recognise", "none.png", "--trocar", EXAMPLE_TROCAR], 2, "does not exist"),
        (["recognise", "grey.png", "--trocar", EXAMPLE_TROCAR], 1, "No instrument's wheel"),
        (["recognise", "small.png", "--trocar", EXAMPLE_TROCAR], 2, "give the camera that took it"),
        (["recognise", "grey.png", "--trocar", EXAMPLE_LIBRARY], 2, "camera is missing"),
        (["timeline", "text.avi", "--trocar", EXAMPLE_TROCAR], 2, "cannot be read as a video"),
        (["timeline", "none.avi", "--trocar", EXAMPLE_TROCAR, "--every", "0"], 2, "--every"),
        (["add", "hook", "--library", "new.toml", "--length-mm", "long"], 2, "--length-mm"),
        (["add", "hook", "--library", "new.toml", "--length-mm", "3", "--colours", "red,blue"], 2, "6 colours"),
    ],
)
def test_what_cannot_be_is_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, glisson: Glisson, words: list[str], code: int, sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    write_photograph("grey.png", np.full((960, 1280, 3), 120, dtype=np.uint8))
    write_photograph("small.png", np.full((96, 128, 3), 120, dtype=np.uint8))
    Path("text.avi").write_text("no video", encoding="utf-8")
    ended, said = glisson("instruments", *words)
    assert ended == code, said
    assert sentence in said["message"]
    assert said["status"] in ("bad_input", "unobservable")


def test_a_video_becomes_a_timeline_and_tips_a_plane(tmp_path: Path, glisson: Glisson, views: WheelViews) -> None:
    """The hook for a second, nothing, then the pointer draws an arc in the plane y = 0."""
    frames, tips = [views.view(scene_of("hook"))] * 4 + [np.full((960, 1280, 3), 90, dtype=np.uint8)] * 8, []
    for step in range(12):
        scene = scene_of("pointer")
        angle = np.radians(-4.0 + 8.0 * step / 11.0)
        out = np.array([np.sin(angle), 0.0, np.cos(angle)])
        depth = 130.0 - 10.0 * (2.0 * step / 11.0 - 1.0) ** 2
        x = np.array([np.cos(angle), 0.0, -np.sin(angle)])
        pose = RigidTransform(
            "trocar", "instrument", np.column_stack([x, np.cross(-out, x), -out]), TROCAR.pivot_mm + depth * out
        )
        frames.append(views.view(replace(scene, trocar_from_instrument=pose)))
        tips.append(pose.apply(scene.instrument.tip_mm))
    write_video(tmp_path / "trocar.avi", frames, 4.0)
    out = tmp_path / "out"
    code, said = glisson("instruments", "timeline", tmp_path / "trocar.avi", "--trocar", EXAMPLE_TROCAR, "--out", out)
    assert code == 0, said
    assert [use["instrument"] for use in said["uses"]] == ["hook", "pointer"]
    assert [use["frames"] for use in said["uses"]] == [4, 12]
    assert said["uses"][1]["from_s"] == pytest.approx(3.0, abs=0.01)
    assert said["not_recognised"] == {"unobservable": 8}
    assert read_photograph(said["picture"]).shape[1] == 960
    track = {one.instrument: one for one in read_tips(out / "tips.json")}["pointer"]
    assert np.linalg.norm(track.points_mm - tips, axis=1).max() < 2.0

    words = ["--instrument", "pointer", "--stroke", "cut,3,6", "--point", "begin,3,3", "--point", "end,5.74,5.76"]
    code, said = glisson(
        "pointer", out / "tips.json", *words, "--resection", "cut", "--towards", "0,1,0", "--into", "0,0,-1", "--out",
        tmp_path / "drawn",
    )  # fmt: skip
    assert code == 0, said
    length = np.linalg.norm(tips[-1] - tips[0])
    assert said["distances"][0]["mm"] == pytest.approx(length, abs=3.0 * said["distances"][0]["sigma_mm"])
    drawn = np.linalg.norm(np.diff(tips, axis=0), axis=1).sum()
    assert said["strokes"]["cut"]["mm"] == pytest.approx(drawn, rel=0.1)
    assert said["status"] == "converged"
    tilt = np.degrees(np.arccos(min(said["plane"]["normal"][1], 1.0)))
    assert tilt < 3.0 * said["plane"]["tilt_sigma_deg"]
    items = {item.name: item for item in read_observations(tmp_path / "drawn" / "observations.json").items}
    assert {name: item.kind for name, item in items.items()} == {
        "begin": "landmark",
        "end": "landmark",
        "cut": "surface",
    }
    assert items["cut"].covariance_mm2 is not None
    assert read_surface(tmp_path / "drawn" / "surface.vtp").triangles.shape == (22, 3)

    for wrong, sentence in (
        (["--instrument", "hook", "--stroke", "a,50,60"], "not seen from 50 to 60 s"),
        (["--instrument", "saw", "--stroke", "a,0,1"], "no track of 'saw'"),
        (["--instrument", "pointer", "--stroke", "a,3,6", "--resection", "b", "--towards", "0,1,0"], "no stroke 'b'"),
        (["--instrument", "pointer", "--stroke", "a,6,3"], "NAME,FROM,TO"),
        (["--instrument", "pointer"], "at least one"),
        (["--instrument", "pointer", "--stroke", "a,3,6", "--resection", "a", "--towards", "0,0,0"], "the zero vector"),
        (["--instrument", "pointer", "--stroke", "a,3,6", "--resection", "a", "--towards", "1,0,0"], "tell the side"),
    ):
        code, said = glisson("pointer", out / "tips.json", *wrong)
        assert code == 2, said
        assert sentence in said["message"]


def test_markers_are_printed(tmp_path: Path, glisson: Glisson) -> None:
    code, said = glisson("markers", "wheel", "hook", "fan retractor", "--out", tmp_path / "wheels.pdf")
    assert (code, said["status"], said["pages"], said["papers"]) == (0, "converged", 2, ["A4", "A4"])
    assert (tmp_path / "wheels.pdf").read_bytes().startswith(b"%PDF")
    layout = EXAMPLE_TROCAR.with_name("layout.toml")
    code, said = glisson("markers", "crosses", layout, "--out", tmp_path / "crosses.pdf")
    assert (code, said["pages"] % 5) == (0, 0)
    code, said = glisson("markers", "board", "charuco:19x26:5:4:4X4_250", "--out", tmp_path / "board.pdf")
    assert (code, said["papers"]) == (0, ["A4"])
    code, said = glisson("markers", "board", "chessboard:9x6:20", "--out", tmp_path / "board.jpg")
    assert (code, said["status"]) == (2, "bad_input")
    code, said = glisson("markers", "board", "chessboard:9x6:90", "--out", tmp_path / "board.pdf")
    assert (code, said["status"]) == (2, "bad_input")
    assert "does not fit on A3" in said["message"]
    code, said = glisson("markers", "wheel", "saw", "--out", tmp_path / "wheels.pdf")
    assert code == 2
    assert "no instrument 'saw'" in said["message"]
