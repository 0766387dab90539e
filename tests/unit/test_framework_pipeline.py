"""The pipeline with three small stages: a number is doubled, a note made of it, the note counted."""

import errno
from collections.abc import Mapping
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

from glisson.core.errors import BadInput, StageFailed
from glisson.core.protocols import Progress
from glisson.core.status import Status
from glisson.framework import settings_file
from glisson.framework.case import SCAN, SETTINGS, STALE, Case, new_case, open_case
from glisson.framework.pipeline import Pipeline
from glisson.framework.provenance import read_record
from glisson.framework.settings import PlaneSettings, Settings
from glisson.framework.stage import Stage
from glisson.io.atomic import WriteFailed


class Doubling(Stage):
    name = "doubling"
    inputs = (SCAN,)
    outputs = ("labels/double.txt",)
    packages = ()
    editable = True
    trouble: ClassVar[BaseException | None] = None

    def settings(self, settings: Settings) -> Mapping[str, Any]:
        return {"target": settings.target}

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        number = 2 * int(case.path(SCAN).read_text())
        (out / self.outputs[0]).write_text(str(number))
        if self.trouble is not None:
            raise self.trouble
        return {"number": number}


class Noting(Stage):
    name = "noting"
    inputs = ("labels/double.txt",)
    outputs = ("results/folder", "results/note.txt")
    packages = ()
    trouble: ClassVar[BaseException | None] = None

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        (out / "results/folder").mkdir()
        (out / "results/folder/a.txt").write_text("a")
        (out / "results/note.txt").write_text("note " + case.path(self.inputs[0]).read_text())
        if self.trouble is not None:
            raise self.trouble
        return {}


class Counting(Stage):
    name = "counting"
    inputs = ("results/note.txt",)
    outputs = ("results/count.txt",)
    packages = ()

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        (out / self.outputs[0]).write_text(str(len(case.path(self.inputs[0]).read_text())))
        return {}


PIPELINE = Pipeline([Doubling(), Noting(), Counting()])


@pytest.fixture(autouse=True)
def _no_techniques(monkeypatch: pytest.MonkeyPatch) -> None:
    """What the file says of the techniques' parameters does not matter here."""
    monkeypatch.setattr(settings_file, "technique_class", lambda kind, name: SimpleNamespace(Parameters=PlaneSettings))


@pytest.fixture
def case(tmp_path: Path) -> Case:
    with new_case(tmp_path / "case", Settings()) as making:
        (making / SCAN).parent.mkdir()
        (making / SCAN).write_text("21")
    return open_case(tmp_path / "case")


def contents(case: Case) -> dict[str, bytes]:
    return {str(p.relative_to(case.folder)): p.read_bytes() for p in case.folder.rglob("*") if p.is_file()}


def ran(case: Case, last: str = "counting", **how: Any) -> list[str]:
    return [name for name, seconds in PIPELINE.run(case, last, **how).seconds.items() if seconds > 0.0]


def test_all_runs_once_then_nothing_does(case: Case) -> None:
    assert ran(case) == ["doubling", "noting", "counting"]
    assert case.path("results/note.txt").read_text() == "note 42"
    before = contents(case)
    result = PIPELINE.run(case, "counting")
    assert list(result.seconds.values()) == [0.0, 0.0, 0.0]
    assert result.facts["doubling"] == {"number": 42}
    assert contents(case) == before


def test_only_what_depends_on_a_change_runs_again(case: Case) -> None:
    ran(case)
    case.path(SCAN).write_text("50")
    assert ran(case) == ["doubling", "noting", "counting"]
    case.path(SCAN).write_text("0050")
    # Another input that gives the same answer: the stages after it stay current.
    assert ran(case) == ["doubling"]
    case.path("results/note.txt").write_text("tampered")
    assert ran(case) == ["noting"]
    assert ran(case, "noting") == []


def test_settings_that_were_used_are_written_with_the_result(case: Case) -> None:
    ran(case)
    assert ran(case, settings=Settings(target="tumour2")) == ["doubling"]
    assert case.settings().target == "tumour2"
    assert ran(case) == []


def test_settings_of_a_failed_run_are_not_kept(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Doubling, "trouble", BadInput("No."))
    before = contents(case)
    with pytest.raises(BadInput):
        ran(case, settings=Settings(target="tumour2"))
    assert contents(case) == before


def test_a_changed_source_or_technique_makes_stale(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    ran(case)
    monkeypatch.setattr("glisson.framework.provenance.source_hash", lambda *packages: "other")
    assert ran(case) == ["doubling", "noting", "counting"]


def test_what_a_person_corrected_is_kept_and_used(case: Case) -> None:
    ran(case)
    case.path("labels/double.txt").write_text("1000")
    assert ran(case) == ["noting", "counting"]
    assert case.path("results/note.txt").read_text() == "note 1000"
    case.path(SCAN).write_text("1")
    assert ran(case) == []


def test_an_explicit_wish_replaces_a_correction_and_keeps_it_beside(case: Case) -> None:
    ran(case)
    case.path("labels/double.txt").write_text("1000")
    assert ran(case, "doubling", replace=True) == ["doubling"]
    assert case.path("labels/double.txt").read_text() == "42"
    assert case.path("labels/previous-double.txt").read_text() == "1000"


@pytest.mark.parametrize(
    ("trouble", "shown"),
    [
        (KeyboardInterrupt(), KeyboardInterrupt),
        (StageFailed("It did not converge.", Status.STAGNATED), StageFailed),
        (BadInput("The lever does not touch."), BadInput),
        (OSError(errno.ENOSPC, "No space left on device"), WriteFailed),
        (PermissionError(errno.EACCES, "Permission denied"), BadInput),
    ],
)
@pytest.mark.parametrize("stage", [Doubling, Noting])
def test_a_stage_that_fails_leaves_the_case_as_it_was(
    case: Case,
    monkeypatch: pytest.MonkeyPatch,
    stage: type[Any],
    trouble: BaseException,
    shown: type[BaseException],
) -> None:
    ran(case, "doubling" if stage is Noting else "counting")
    if stage is Doubling:
        for path in case.folder.glob("labels/*"):
            path.unlink()
        case.path("results/provenance/doubling.json").unlink()
    monkeypatch.setattr(stage, "trouble", trouble)
    before = contents(case)
    with pytest.raises(shown) as caught:
        ran(case)
    after = contents(case)
    after.pop(STALE, None)
    assert after == before
    assert not [p for p in case.folder.iterdir() if p.name.startswith(".")]
    if isinstance(caught.value, WriteFailed):
        assert "disk is full" in str(caught.value)


def test_old_results_are_kept_but_never_look_current(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    ran(case)
    assert not case.has(STALE)
    case.path(SCAN).write_text("50")
    monkeypatch.setattr(Noting, "trouble", StageFailed("It did not converge.", Status.STAGNATED))
    with pytest.raises(StageFailed):
        ran(case)
    assert case.path("results/note.txt").read_text() == "note 42"
    assert "noting" in case.path(STALE).read_text()
    assert "counting" in case.path(STALE).read_text()
    assert list(PIPELINE.outdated(case)) == ["noting", "counting"]
    monkeypatch.setattr(Noting, "trouble", None)
    ran(case)
    assert not case.has(STALE)
    assert PIPELINE.outdated(case) == {}


def test_an_interruption_while_results_are_put_in_place_takes_all_back(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    import os

    ran(case)
    case.path(SCAN).write_text("50")
    ran(case, "doubling")
    before = contents(case)
    renames = []
    real = os.replace

    def interrupted(source: Any, target: Any) -> None:
        renames.append(target)
        if len(renames) == 4:
            raise KeyboardInterrupt
        real(source, target)

    monkeypatch.setattr("glisson.framework.placing.os.replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        ran(case)
    assert contents(case) == before


def test_leftovers_of_a_killed_run_are_swept_away(case: Case) -> None:
    case.path(".work/labels").mkdir(parents=True)
    case.path(".work/labels/double.txt").write_text("half")
    ran(case)
    assert not case.path(".work").exists()


def test_the_record_says_where_the_result_came_from(case: Case) -> None:
    ran(case)
    record = read_record(case.path("results/provenance/noting.json"))
    assert record is not None
    assert set(record.basis.inputs) == {"labels/double.txt"}
    assert set(record.outputs) == {"results/folder", "results/note.txt"}
    assert record.versions["glisson"]
    assert record.seconds >= 0.0
    assert SETTINGS not in record.basis.inputs


@pytest.mark.parametrize("damage", ["", "{", '{"stage": 3}', "[]", '{"basis": {}}'])
def test_a_damaged_record_is_as_good_as_none(case: Case, damage: str) -> None:
    ran(case)
    case.path("results/provenance/counting.json").write_text(damage)
    assert ran(case) == ["counting"]


class Beside(Stage):
    name = "beside"
    inputs = ("labels/double.txt",)
    outputs = ("labels/beside.txt",)
    packages = ()

    def run(self, case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        (out / self.outputs[0]).write_text("beside")
        return {}


def test_only_stages_that_are_needed_run(case: Case) -> None:
    pipeline = Pipeline([Doubling(), Noting(), Counting(), Beside()])
    assert set(pipeline.run(case, "beside").seconds) == {"doubling", "beside"}
    assert set(pipeline.run(case, "counting").seconds) == {"doubling", "noting", "counting"}
    case.path(SCAN).write_text("8")
    pipeline.run(case, "beside")
    # Results of a stage that was not asked for are told to be out of date, not made anew.
    assert "counting" in pipeline.outdated(case)
    assert case.has(STALE)
