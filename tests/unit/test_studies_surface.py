"""The study of two-view reconstruction in small: printed tables, the fit, and what the conclusion says."""

from pathlib import Path

import numpy as np
import pytest

from glisson.cli import study as command
from glisson.core import Status
from glisson.studies.point import Outcome
from glisson.studies.surface.printed import PRINTED_MM
from glisson.studies.surface.study import SurfaceStudy
from glisson.studies.surface.tasks import fit_noise, reconstruct_views
from studies_in_process import InThisProcess

SMALL = SurfaceStudy(seed=3, seeds=4, fit_seeds=30, rendered=0)


def test_printed_means_are_those_of_the_anchors() -> None:
    rounded = {name: round(mean, 2) for name, mean in PRINTED_MM.items()}
    assert rounded == {"1-2": 6.93, "1-3": 1.67, "1-4": 1.52, "half": 4.87, "full": 2.05}


def test_the_fit_makes_the_construction_as_wrong_as_printed(tmp_path: Path) -> None:
    found = fit_noise({"seeds": 60}, tmp_path).values
    assert found["mean_mm"] == pytest.approx(PRINTED_MM["1-2"], rel=0.01)
    assert found["noise"]["position_mm"] == pytest.approx(found["factor"])
    assert found["noise"]["direction_deg"] == pytest.approx(2.0 * found["factor"])


def test_draws_are_the_same_for_the_same_seed_and_others_for_another(tmp_path: Path) -> None:
    noise = fit_noise({"seeds": 20}, tmp_path).values["noise"]
    inputs = {"noise": noise, "stream": 3, "first": 0, "seeds": 1, "names": ["1-4"]}
    first, again, other = (
        reconstruct_views({**inputs, "stream": stream}, tmp_path).values["rows"] for stream in (3, 3, 4)
    )
    assert first == again
    assert first != other


def test_the_study_says_what_its_draws_say(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, glisson) -> None:
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    monkeypatch.setattr(SurfaceStudy, "of", classmethod(lambda cls, quick, seed: SMALL))
    code, said = glisson("study", "surface", "--out", tmp_path / "out", "--seed", 3)
    assert code == 0, said
    assert set(said["pairs"]) == {"1-2", "1-3", "1-4"}
    assert [said["pairs"][name]["angle_deg"] for name in ("1-2", "1-3", "1-4")] == [3.28, 8.14, 11.85]
    assert set(said["breathing"]) == {"half", "full"}
    for row in (*said["pairs"].values(), *said["breathing"].values()):
        assert {"angle_deg", "classic_mm", "joint_mm", "coverage90"} <= set(row)
        assert set(row["joint_mm"]) == {"median", "p95", "worst"}
        assert row["draws"] == 4
    assert said["breathing"]["half"]["flagged"] == 1.0
    assert said["pairs"]["1-4"]["joint_mm"]["median"] < said["pairs"]["1-4"]["classic_mm"]["median"]
    assert said["unfinished"] == 0
    for name in ("rows.csv", "report.html", "errors.png", "results.json"):
        assert (tmp_path / "out" / name).is_file()


def test_points_that_failed_are_told() -> None:
    prepared = {
        SMALL.preparations()[0].key: Outcome({"factor": 0.1, "mean_mm": 7.0, "noise": _noise()}),
    }
    points = SMALL.points(prepared)
    done = {points[0].key: Outcome(status=Status.STAGNATED, message="It stood still.")}
    told = SMALL.conclude(prepared, done)
    assert told.values["pairs"]["1-2"]["joint_mm"] is None
    assert told.values["failed"] == ["It stood still."]
    assert told.values["unfinished"] == len(points) - 1
    assert "not done yet" in told.text


def _noise() -> dict[str, float]:
    names = ("position_mm", "direction_deg", "roll_deg", "touched_mm", "tip_px", "landmark_px", "feature_px")
    return dict.fromkeys(names, float(np.float64(0.1)))
