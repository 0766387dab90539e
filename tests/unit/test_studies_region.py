"""The study of the region of interest: distributions of what the points say, and the command on small lifts."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from glisson.cli import study as command
from glisson.studies.point import Outcome
from glisson.studies.region.study import RegionStudy
from studies_in_process import InThisProcess

Glisson = Callable[..., tuple[int, dict[str, Any]]]


def test_the_conclusion_has_the_distributions() -> None:
    study = RegionStudy(members=3, elements=1000)
    points = study.points({})
    tumour = {"moved_mm": 10.0, "apart_mm": 0.1, "estimated_mm": 0.05}
    outcomes = [
        Outcome({"elements": 998, "whole_seconds": 12.0, "region_seconds": 4.0, "tumours": [tumour]}),
        Outcome(
            {
                "elements": 1010,
                "whole_seconds": 20.0,
                "region_seconds": 4.0,
                "tumours": [tumour, tumour | {"apart_mm": 0.02, "estimated_mm": 0.08}],
            }
        ),
    ]
    done = dict(zip([point.key for point in points], outcomes, strict=False))
    values = study.conclude({}, done).values
    assert values["times_as_fast"] == {"median": 4.0, "p5": pytest.approx(3.1), "worst": 3.0}
    assert values["apart_mm"]["worst"] == 0.1
    assert values["estimate_off_by"]["median"] == pytest.approx(2.0)
    assert values["estimate_off_by"]["worst"] == pytest.approx(4.0)
    assert (len(values["rows"]), values["failed"], values["unfinished"]) == (3, [], 1)


def test_the_command_compares_a_small_lift(glisson: Glisson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Even on a coarse mesh the region ends near the whole organ; a failed member would be named."""
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    monkeypatch.setattr("glisson.studies.region.study.QUICK_MEMBERS", 1)
    monkeypatch.setattr("glisson.studies.region.study.QUICK_ELEMENTS", 2200)
    monkeypatch.setattr(RegionStudy, "preparations", lambda study: [])
    code, said = glisson("study", "region", "--quick", "--out", tmp_path)
    assert code == 0, said["message"]
    assert said["failed"] == []
    assert said["rows"][0]["moved_mm"] > 5.0
    assert said["apart_mm"]["worst"] < 0.3
    assert (tmp_path / "report.html").exists()
