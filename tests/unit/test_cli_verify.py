"""`glisson verify`: keys as in the design's section 5, exit codes, and the report page."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from glisson.verification import suite
from glisson.verification.bodies import FRAME_INDIFFERENT
from glisson.verification.check import Case, Check, Unavailable

Glisson = Callable[..., tuple[int, dict[str, Any]]]


def test_checks_are_told_to_machines_and_in_a_page(glisson: Glisson, tmp_path: Path) -> None:
    code, said = glisson("verify", "--only", "rigid", "--out", tmp_path / "page")
    assert code == 0
    assert said["orders"] == []
    assert len(said["checks"]) == 2 * len(FRAME_INDIFFERENT)
    for check in said["checks"]:
        assert check["name"].startswith("rigid/")
        assert check["passed"] is True
        assert abs(check["value"] - check["expected"]) <= check["tolerance"] == 1e-9
        assert check["reason"] is None
    page = (tmp_path / "page" / "report.html").read_text()
    assert f"All {2 * len(FRAME_INDIFFERENT)} checks passed" in page
    assert "http" not in page.replace("http-equiv", "")


def test_a_failed_check_exits_with_1(glisson: Glisson, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def absent() -> list[Check]:
        raise Unavailable("ccx is <missing>")

    cases = (
        Case("mms/wrong", "a wrong figure", lambda: [Check("mms/wrong/x", 2.0, 1.0, 0.5)]),
        Case("calculix/absent", "an absent engine", absent),
    )
    monkeypatch.setattr(suite, "CASES", cases)
    code, said = glisson("verify", "--out", tmp_path)
    assert code == 1
    wrong, missing = said["checks"]
    assert (wrong["passed"], wrong["value"]) == (False, 2.0)
    assert (missing["passed"], missing["value"], missing["reason"]) == (False, None, "ccx is <missing>")
    page = (tmp_path / "report.html").read_text()
    assert "2 of 2 checks failed" in page
    assert "ccx is &lt;missing&gt;" in page


def test_an_unknown_prefix_is_bad_input(glisson: Glisson, tmp_path: Path) -> None:
    code, said = glisson("verify", "--only", "nothing", "--out", tmp_path)
    assert code == 2
    assert said["checks"] is None
    assert "No check begins with 'nothing'" in said["message"]


def test_a_place_that_takes_no_report_is_bad_input(glisson: Glisson, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    code, said = glisson("verify", "--only", "rigid", "--out", tmp_path / "file")
    assert code == 2
    assert "cannot go to" in said["message"]
