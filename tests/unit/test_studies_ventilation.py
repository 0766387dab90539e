"""The study of ventilation: a small form of it runs, its sums are right, and its twins are what they say."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.cli import study as command
from glisson.studies.point import Outcome
from glisson.studies.ventilation.recordings import RATES_HZ, draw_sweep
from glisson.studies.ventilation.study import VentilationStudy
from studies_in_process import InThisProcess


def test_a_small_study_finds_plateaus_and_phases(
    glisson: Callable[..., tuple[int, dict[str, Any]]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    small = VentilationStudy(seed=3, sweeps=5, pixel_sweeps=0, breaths=2, pixel_breaths=0, conventional=1)
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    monkeypatch.setattr(VentilationStudy, "of", classmethod(lambda cls, quick, seed: small))
    code, said = glisson("study", "ventilation", "--out", tmp_path)
    assert code == 0, said
    assert said["failed"] == []
    assert said["conventional_mm"] == pytest.approx(15.0, abs=2.0)
    assert said["plateau_hz"][0]["true"] == 10.8
    assert said["found_within"] >= 0.75
    assert said["phase"]["simulated"]["phase_worst"]["worst"] < 0.03
    assert said["phase"]["simulated"]["residual_mm"]["worst"] < 0.5
    assert 0.0 < said["noise_px"] < 0.1
    assert len(said["rates"]) == len(RATES_HZ)
    for name in ("figure-II.45.png", "figure-II.46.png", "report.html"):
        assert (tmp_path / name).stat().st_size > 10_000


def test_sweeps_are_flat_from_their_break_on_and_fall_before() -> None:
    for seed in range(40):
        sweep = draw_sweep(seed, first=seed == 0)
        values = np.array(sweep.displacements_mm)
        above = sweep.break_hz <= RATES_HZ
        assert above.sum() >= 4
        assert values[above].std() < 0.04
        assert values[0] > values[above].mean() + 2.0
        assert 6.0 <= sweep.break_hz <= 12.0
        assert sweep.exposure_s <= 1.0 / sweep.camera_frames_per_s
    assert draw_sweep(0, first=True).break_hz == 10.8
    assert draw_sweep(0, first=True).is_resolvable


def test_the_conclusion_counts_what_is_flagged() -> None:
    study = VentilationStudy(sweeps=1, pixel_sweeps=3, breaths=0, pixel_breaths=0, conventional=0)
    prepared = {"": Outcome({"noise_px": 0.02, "frames_per_s": 80.0})}
    points = study.points(prepared)
    row = {
        "interval": [9.8, 10.2], "rates_resolvable": 18, "false_flags": 0, "missed_flags": 1, "true_mm": [],
        "displacements": [{}] * 21, "frames_per_s": 60.0, "exposure_ms": 4.0, "seed": 1,
    }  # fmt: skip
    rows = [
        row | {"true": 10.0, "found": 10.1, "resolvable": True},
        row | {"true": 10.0, "found": 10.5, "resolvable": True},
        row | {"true": 10.0, "found": None, "interval": None, "resolvable": True, "false_flags": 18},
        row | {"true": 11.0, "found": 7.0, "resolvable": False},
    ]
    done = {point.key: Outcome({"rows": [one]}) for point, one in zip(points, rows, strict=True)}
    values = study.conclude(prepared, done).values
    assert values["plateau_hz"][1] == {"true": 10.0, "found": 10.5}
    assert values["found_within"] == pytest.approx(1 / 3)
    assert values["found_within_from_pixels"] == 0.0
    assert values["false_flags"] == pytest.approx(1 / 3)
    assert (values["resolvable"], values["unresolvable"], values["silent_wrong"]) == (3, 1, 1)
    assert values["interval_holds"] == 1.0
    assert values["rate_false_flags"] == pytest.approx(18 / 72)
    assert values["rate_missed_flags"] == pytest.approx(4 / 12)
    assert values["sweeps"] == {"simulated": 1, "from_pixels": 3}
    assert values["conventional_mm"] is None
