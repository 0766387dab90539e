"""The study of the elements: what is measured, and by how much T4's error at equal time is larger."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from glisson.cli import study as command
from glisson.studies.elements import tasks
from glisson.studies.elements.study import Elements
from glisson.studies.elements.tasks import sample_points, target_error_mm, whole_error_mm
from glisson.studies.point import Outcome
from studies_in_process import InThisProcess

Glisson = Callable[..., tuple[int, dict[str, Any]]]


def test_errors_are_those_of_a_known_motion() -> None:
    points = sample_points()
    target = points[np.linalg.norm(points - [100.0, 50.0, 25.0], axis=1) < 12.0 + 1e-9]
    assert len(target) >= 200
    shifted = np.tile([0.0, 3.0, 4.0], (len(points), 1))
    assert target_error_mm(shifted, np.zeros_like(points)) == pytest.approx(5.0)
    assert whole_error_mm(shifted, np.zeros_like(points)) == pytest.approx(5.0)
    # A turn about the target's middle leaves its centroid where it is.
    turned = 0.1 * np.cross([0.0, 0.0, 1.0], points - points[:200].mean(axis=0))
    assert target_error_mm(turned, np.zeros_like(points)) < 1e-12
    assert whole_error_mm(turned, np.zeros_like(points)) > 1.0


def test_t4_is_judged_at_equal_time() -> None:
    """T4's error falls by half where its time doubles; T10 has a tenth of it after the time of T4's second solution."""
    study = Elements({"T4": (2, 3, 4), "T10": (1,)}, 5)
    prepared = {point.key: Outcome({"solve_seconds": 9.0}) for point in study.preparations()}
    done = {}
    for point in study.points(prepared):
        number = ("T4", "T10").index(point.inputs["element"])
        seconds = 2.0 ** (point.inputs["cubes"] - 2) if number == 0 else np.sqrt(2.0)
        error = 8.0 / seconds if number == 0 else 0.1
        done[point.key] = Outcome({"solve_seconds": seconds, "elements": 6, "unknowns": 24, "whole_mm": error})
    found = study.conclude(prepared, done)
    for advantage in found.values["advantage"]:
        assert advantage["t4_mm"] == pytest.approx(8.0 / np.sqrt(2.0))
        assert advantage["t10_mm"] == 0.1
    assert [advantage["poisson_ratio"] for advantage in found.values["advantage"]] == [0.45, 0.499]
    assert "56.6 times less" in found.text
    assert set(found.files) == {"rows.csv", "report.html", "errors.png"}


def test_the_command_measures_small_blocks(glisson: Glisson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both elements come nearer to the reference as they get smaller, and T10 is nearer than T4 of the same number."""
    monkeypatch.setattr(command, "LocalPool", InThisProcess)
    monkeypatch.setattr("glisson.studies.elements.study._QUICK_CUBES", {"T4": (1, 2), "T10": (1, 2)})
    monkeypatch.setattr("glisson.studies.elements.study._QUICK_REFERENCE_CUBES", 3)
    assert tasks.counts_of(2) == (6, 4, 2)
    code, said = glisson("study", "elements", "--quick", "--out", tmp_path)
    assert code == 0, said["message"]
    for ratio in (0.45, 0.499):
        errors = {
            (row["element"], row["cubes"]): row["whole_mm"] for row in said["rows"] if row["poisson_ratio"] == ratio
        }
        assert errors["T4", 2] < errors["T4", 1]
        assert errors["T10", 2] < errors["T10", 1] < errors["T4", 1]
    assert (tmp_path / "errors.png").read_bytes().startswith(b"\x89PNG")
