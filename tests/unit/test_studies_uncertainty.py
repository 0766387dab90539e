"""The study of error bars in small: its figures by drawn rows of known coverage, and one liver from end to end."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.cli import study as command
from glisson.mechanics.registration.posterior import INFLATION
from glisson.studies.uncertainty import study
from glisson.studies.uncertainty.design import COVERAGES, UncertaintyDesign
from glisson.studies.uncertainty.scores import inflation, scores, touch
from glisson.studies.uncertainty.study import UncertaintyStudy
from glisson.studies.uncertainty.tasks import expected_length
from studies_in_process import InThisProcess


def drawn_rows(scale: float, rng: np.random.Generator) -> list[dict[str, Any]]:
    """40 livers of 5 cases of 159 targets, with errors `scale` times as large as said."""
    return [
        {
            "member": member, "status": "converged", "predicted_mm": 2.0, "actual_mm": 2.0 + 0.1 * number,
            "squares": (scale**2 * rng.chisquare(3, size=159)).tolist(),
        }
        for member in range(40) for number in range(5)
    ]  # fmt: skip


def test_true_error_bars_are_told_to_be_true_and_short_ones_to_be_short() -> None:
    rng = np.random.default_rng(1)
    true, short = drawn_rows(1.0, rng), drawn_rows(1.5, rng)
    told = scores(true)
    for level in (50, 90, 95):
        found = told[f"coverage{level}"]
        assert found["share"] == pytest.approx(level / 100.0, abs=0.01)
        assert found["low"] < found["share"] < found["high"]
    # The standard error of a share of 31,800 independent targets; the interval is 2 × 1.96 of it.
    width = told["coverage90"]["high"] - told["coverage90"]["low"]
    assert width == pytest.approx(3.92 * np.sqrt(0.9 * 0.1 / (40 * 5 * 159)), rel=0.35)
    assert (told["cases"], told["livers"], told["flagged"]) == (200, 40, 0)
    assert told["difference_mm"] == pytest.approx(0.2)
    assert told["correlation"] is None
    assert inflation(true) == pytest.approx(1.0, abs=0.02)
    assert inflation(short) == pytest.approx(1.5, abs=0.03)
    assert scores(short)["coverage90"]["high"] < 0.8
    assert scores([])["coverage90"] is None


def test_the_interval_knows_that_targets_of_a_liver_go_together() -> None:
    """All targets of a liver alike: the interval is that of so many livers, not of so many targets."""
    rows = [{"member": m, "status": "converged", "predicted_mm": 1.0, "actual_mm": 1.0, "squares": [m % 2 * 99.0] * 159}
            for m in range(40)]  # fmt: skip
    found = scores(rows)["coverage90"]
    assert found["share"] == 0.5
    assert found["high"] - found["low"] == pytest.approx(3.92 * 0.5 / np.sqrt(40), rel=0.15)


def test_the_expected_length_is_that_of_draws() -> None:
    """As its docstring says: 1 % where all axes are alike, never more than 7 % too small."""
    rng = np.random.default_rng(2)
    for axes, least in (((1.0, 1.0, 1.0), 0.99), ((3.0, 1.0, 1.0), 0.93), ((1.0, 0.01, 0.01), 0.93)):
        drawn = np.linalg.norm(rng.normal(size=(100_000, 3)) * axes, axis=1).mean()
        assert least < expected_length(np.diag(np.square(axes))[None])[0] / drawn < 1.005


def test_a_touch_is_worth_what_its_pairs_say() -> None:
    rng = np.random.default_rng(3)
    other = rng.uniform(1.0, 5.0, size=100)
    rows = [{"touch": {"before": 4.0, "proposed": 0.8 * one, "random": one}} for one in other]
    told = touch([*rows, {"touch": None}])
    assert (told["cases"], told["before_mm"]) == (100, 4.0)
    assert told["gain_percent"] == pytest.approx(20.0)
    assert told["p"] < 1e-10
    assert touch([])["p"] is None


def test_each_liver_has_cases_of_its_own() -> None:
    design = UncertaintyDesign()
    assert sum(len(design.cases(member)) for member in design.reported) >= 1000
    assert not set(design.reported) & set(design.tuning)
    cases = [case for member in design.reported[:10] for case in design.cases(member)]
    assert {case.bin for case in cases} == set(range(len(COVERAGES)))
    assert all(COVERAGES[case.bin][0] <= case.coverage <= COVERAGES[case.bin][1] for case in cases)
    touched = [len(set(design.touched(member))) for member in design.reported]
    assert min(touched) == 5
    assert design.touched(design.tuning[0]) == ()
    bent = [(case.member, case.deformation) for case in cases if case.origin == "closed-form"]
    assert len(set(bent)) == len(bent) == 70


def test_one_liver_from_end_to_end(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, glisson) -> None:
    small = UncertaintyStudy(UncertaintyDesign(livers=1, tuning_livers=0, cases_each=2))
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    monkeypatch.setattr(UncertaintyStudy, "of", classmethod(lambda cls, quick, seed: small))
    monkeypatch.setattr(study, "TRUTH_EDGE_MM", 32.0)
    code, said = glisson("study", "uncertainty", "--quick", "--out", tmp_path / "out")
    assert code == 0, said
    assert (said["cases"], said["livers"], said["failed"], said["unfinished"]) == (2, 1, [], 0)
    for level in (50, 90, 95):
        assert set(said[f"coverage{level}"]) == {"share", "low", "high"}
    assert 0.5 < said["predicted_mm"] < 15.0
    assert 0.5 < said["actual_mm"] < 15.0
    assert said["correlation"] is None
    assert said["touch"]["cases"] + said["touch_denser"]["cases"] == 2
    assert {"before_mm", "proposed_mm", "random_mm", "gain_percent", "p"} <= set(said["touch"])
    assert said["parts"]["packed"]["cases"] == said["parts"]["closed-form"]["cases"] == 1
    assert said["inflation"] == INFLATION
    assert said["tuning"]["inflation"] is None
    for name in ("rows.csv", "report.html", "calibration.png", "results.json"):
        assert (tmp_path / "out" / name).stat().st_size > 100
