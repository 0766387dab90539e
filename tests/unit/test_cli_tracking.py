"""`glisson track` and `glisson breathing` on a small rendered video, and what they refuse."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.tracks import Tracks
from glisson.io.camera_files import write_camera
from glisson.io.track_files import read_tracks, write_tracks
from glisson.io.video import write_video
from glisson.phantom.breathing.exposing import Shutter
from glisson.phantom.breathing.motion import Irregularity, draw_breaths
from glisson.phantom.breathing.tissue import draw_tissue
from glisson.phantom.breathing.view import BreathingVideo
from glisson.phantom.optics import ray_slopes

Recording = tuple[Path, BreathingVideo, FloatArray]
Glisson = Callable[..., tuple[int, dict[str, Any]]]
CAMERA = Camera(480, 270, [320.0, 320.0], [241.0, 134.0], [-0.22, 0.06, 0.0, 0.0, 0.0])
MM_PER_PX = 0.28


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    rng = np.random.default_rng(31)
    breaths = draw_breaths(4.0, 16.0, Irregularity(), rng)
    video = BreathingVideo(CAMERA, draw_tissue(20.0, rng, 10), breaths, 200, Shutter(12.5, 0.01, 0.02))
    path = tmp_path_factory.mktemp("video") / "liver.avi"
    write_video(path, video.images(), 12.5)
    return path, video, breaths.starts_s


def test_a_video_is_followed_and_its_breaths_are_told(recording: Recording, glisson: Glisson, tmp_path: Path) -> None:
    path, video, starts = recording
    code, said = glisson("track", path, "--count", 10, "--mm-per-px", MM_PER_PX, "--out", tmp_path)
    assert code == 0, said
    assert (said["status"], said["frames"], said["unit"], len(said["markers"])) == ("converged", 200, "mm", 10)
    assert Path(said["picture"]).read_bytes().startswith(b"\x89PNG")
    tracks = read_tracks(said["file"])
    truth = MM_PER_PX * video.marks_px()
    number = np.linalg.norm(tracks.places[0][:, None] - truth[0][None], axis=2).argmin(axis=1)
    off = tracks.places - tracks.places[0] - (truth - truth[0])[:, number]
    assert np.nanmedian(np.linalg.norm(off, axis=2)) < 0.05

    code, said = glisson("breathing", tmp_path / "liver.tracks.csv", "--out", tmp_path)
    assert code == 0, said
    assert said["status"] == "converged"
    assert said["breaths"] >= 2
    for found in said["exhalations_s"]:
        assert np.abs(starts - found).min() < 0.03 * 4.0 + 0.04
    assert said["displacement"] == pytest.approx(20.0, rel=0.2)
    assert 0 < len(said["gate_frames"]) < 100
    assert Path(said["picture"]).read_bytes().startswith(b"\x89PNG")


def test_tracks_are_in_mm_by_a_camera(recording: Recording, glisson: Glisson, tmp_path: Path) -> None:
    path, video, _ = recording
    write_camera(tmp_path / "camera.toml", CAMERA)
    u, v = video.marks_px()[0, 4]
    distance = video.tissue.middle_mm[2]
    words = ["--at", f"{u:.2f},{v:.2f}", "--out", tmp_path, "--camera", tmp_path / "camera.toml"]
    code, said = glisson("track", path, *words, "--distance-mm", f"{distance:.3f}")
    assert (code, said["unit"]) == (0, "mm"), said
    assert said["file"] == str(tmp_path / "liver.tracks.csv")
    place = read_tracks(said["file"]).places[0, 0]
    assert place == pytest.approx(distance * ray_slopes(CAMERA, [[u, v]])[0], abs=0.01)
    code, said = glisson("track", path, *words)
    assert code == 2
    assert "belong together" in said["message"]
    write_camera(tmp_path / "camera.toml", Camera(1920, 1080, [1300.0, 1300.0], [960.0, 540.0]))
    code, said = glisson("track", path, *words, "--distance-mm", f"{distance:.3f}")
    assert (code, said["status"]) == (2, "bad_input")
    assert "480 × 270 px, its camera was calibrated at 1920 × 1080 px" in said["message"]
    write_camera(tmp_path / "camera.toml", Camera(240, 135, [160.0, 160.0], [120.0, 67.0]))
    write_tracks(tmp_path / "still.csv", strokes(5.0, 0.0))
    code, said = glisson("breathing", tmp_path / "still.csv", *words[2:], "--distance-mm", "90")
    assert code == 2
    assert "leave the camera's image of 240 × 135 px" in said["message"]


def test_markers_may_be_given(recording: Recording, glisson: Glisson, tmp_path: Path) -> None:
    path, video, _ = recording
    u, v = video.marks_px()[0, 4]
    code, said = glisson("track", path, "--at", f"{u:.2f},{v:.2f}", "--out", tmp_path)
    assert code == 0, said
    assert said["markers"][0]["first_px"] == pytest.approx([u, v], abs=0.01)
    assert said["unit"] == "px"


def test_a_video_that_ends_early_is_used_as_far_as_it_goes(
    recording: Recording, glisson: Glisson, tmp_path: Path
) -> None:
    torn = tmp_path / "torn.avi"
    torn.write_bytes(recording[0].read_bytes()[: recording[0].stat().st_size // 2])
    code, said = glisson("track", torn, "--count", 10)
    assert code == 0, said
    assert "ends early" in said["notes"][0]
    assert 50 < said["frames"] < 150


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (["track", "none.avi"], 2, "There is no video"),
        (["track", "noise.avi"], 2, "cannot be read as a video"),
        (["track", "liver.avi", "--at", "1,2,3"], 2, "U,V"),
        (["track", "liver.avi", "--at", "2,2"], 2, "px from the border"),
        (["track", "liver.avi", "--at", "100,100", "--count", "5"], 2, "--count"),
        (["track", "liver.avi", "--count", "400"], 1, "dark spots"),
        (["track", "liver.avi", "--mm-per-px", "nan"], 2, "--mm-per-px"),
        (["track", "liver.avi", "--technique", "guess"], 2, "no marker-tracker technique"),
        (["breathing", "none.csv"], 2, "cannot be read"),
        (["breathing", "still.csv"], 1, "repeats itself"),
        (["breathing", "still.csv", "--exhaled-at", "0"], 1, "repeats itself"),
        (["breathing", "still.csv", "--exhaled-at", "500"], 2, "in the recording, from 0 to 3.98 s, not 500 s"),
        (["breathing", "still.csv", "--exhaled-at", "nan"], 2, "in the recording"),
        (["breathing", "still.csv", "still.csv"], 2, "--rate-hz"),
        (["breathing", "still.csv", "--rate-hz", "4", "--rate-hz", "5"], 2, "one for each"),
        (["breathing", "still.csv", "--rate-hz", "0"], 2, "--rate-hz"),
    ],
)
def test_what_cannot_be_is_one_sentence(
    recording: Recording,
    glisson: Glisson,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    code: int,
    sentence: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "liver.avi").symlink_to(recording[0])
    (tmp_path / "noise.avi").write_bytes(b"no video" * 100)
    write_tracks(tmp_path / "still.csv", strokes(5.0, 0.0))
    ended, said = glisson(*words)
    assert ended == code, said
    assert sentence in said["message"]


def strokes(rate: float, amplitude: float, frames_per_s: float = 50.0) -> Tracks:
    rng = np.random.default_rng(int(10 * rate))
    times = np.arange(200) / frames_per_s
    places = 300.0 + 0.03 * rng.standard_normal((200, 4, 2))
    places[:, :, 1] += amplitude * np.cos(2.0 * np.pi * rate * times)[:, None]
    return Tracks(times, places, np.broadcast_to(9e-4 * np.eye(2), (200, 4, 2, 2)), np.zeros((200, 4), dtype=np.int8))


def test_rates_are_compared_and_the_plateau_is_told(glisson: Glisson, tmp_path: Path) -> None:
    rates = np.arange(4.0, 13.01, 0.5)
    files, words = [tmp_path / f"{rate:g}.csv" for rate in rates], []
    for rate, path in zip(rates, files, strict=True):
        write_tracks(path, strokes(rate, 2.0 + 2.5 * max(9.2 - rate, 0.0)))
        words += ["--rate-hz", f"{rate:g}"]
    code, said = glisson("breathing", *files, *words, "--exposure-ms", "0.01")
    assert code == 0, said
    assert said["plateau_hz"] == pytest.approx(9.2, abs=0.3)
    low, high = said["interval_hz"]
    assert low <= 9.2 <= high
    assert [row["rate_hz"] for row in said["rates"]] == rates.tolist()
    assert said["displacement"] == pytest.approx(4.0, rel=0.02)
    assert Path(said["picture"]).read_bytes().startswith(b"\x89PNG")
