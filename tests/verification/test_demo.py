"""The main job as a new user runs it: the demo from its CT to the report, against CalculiX's truth."""

from collections.abc import Callable
from pathlib import Path
from typing import Any


def test_the_demo_runs_from_its_scan_to_the_report(glisson: Callable[..., tuple[int, dict[str, Any]]], tmp_path: Path):
    code, said = glisson("demo", "--out", tmp_path / "demo")
    assert code == 0, said["message"]
    assert said["status"] == "converged"
    (tumour,) = said["tumours"]
    assert tumour["error_mm"] < 1.0
    assert (tmp_path / "demo" / "results" / "report.html").stat().st_size > 100_000
