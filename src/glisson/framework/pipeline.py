"""Runs the stages of a case that are stale, one after the other, each whole or not at all.

A stage writes into a folder of its own; only when it ended well are its outputs and its record renamed
into the case, all or none. So an interruption, a failure or a full disk leaves the case as it was.
"""

import errno
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from glisson.core.errors import BadInput
from glisson.core.protocols import Progress, silent
from glisson.core.registry import technique_class
from glisson.framework.case import RESULTS, SETTINGS, STALE, Case
from glisson.framework.hashing import content_hash
from glisson.framework.lock import exclusive
from glisson.framework.placing import put_in_place
from glisson.framework.provenance import StageRecord, record_of
from glisson.framework.settings import Settings
from glisson.framework.settings_file import settings_text
from glisson.framework.stage import Stage, State, outdated, stage_state
from glisson.io.atomic import WriteFailed

_WORK = ".work"


class Listener(Protocol):
    """Told what the pipeline does, to show it to people."""

    def begun(self, stage: str, reason: str) -> Progress:
        """A stage starts to run, because of `reason`; what is returned is told its progress."""

    def ended(self, stage: str, seconds: float) -> None:
        """A stage ended well."""

    def skipped(self, stage: str, reason: str) -> None:
        """A stage need not run."""


class Unheard:
    """A listener that says nothing."""

    def begun(self, stage: str, reason: str) -> Progress:
        """Nothing is shown."""
        return silent

    def ended(self, stage: str, seconds: float) -> None:
        """Nothing is shown."""

    def skipped(self, stage: str, reason: str) -> None:
        """Nothing is shown."""


@dataclass(frozen=True)
class RunResult:
    """Seconds of each stage (0 where it was skipped) and its facts, also those of an earlier run."""

    seconds: Mapping[str, float]
    facts: Mapping[str, Mapping[str, Any]]


class Pipeline:
    """The stages of a case in an order in which each comes after those that it needs."""

    def __init__(self, stages: Sequence[Stage]) -> None:
        self._stages = tuple(stages)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the stages in order."""
        return tuple(stage.name for stage in self._stages)

    def run(
        self,
        case: Case,
        last: str,
        settings: Settings | None = None,
        replace: bool = False,
        listener: Listener | None = None,
    ) -> RunResult:
        """Bring `last` and the stages that it needs up to date, under the lock of the case.

        Where results of any stage are out of date when this ends, well or not, `results/STALE.txt` says so.

        Args:
            case: the case.
            last: name of the last stage that is wanted.
            settings: other settings than those of `case.toml`; they are written there with the first result.
            replace: whether the stage `last` runs anew although a person gave its outputs. The files that
                were given stay beside the new ones, named `previous-…`.
            listener: told what happens.

        Raises:
            BadInput: the case, its settings or an input cannot be used.
            StageFailed: a stage gave no result.
            WriteFailed: the disk is full or failing.
        """
        heard = listener or Unheard()
        used = case.settings() if settings is None else settings
        wanted = self._needed(last)
        for stage in wanted:
            for kind, name in stage.techniques(used):
                technique_class(kind, name)
        case.check_writable()
        with exclusive(case.folder), _disk_errors_as_sentences(case):
            given = wanted[:-1] if replace else wanted
            _require_effect(given, case, used)
            shutil.rmtree(case.path(_WORK), ignore_errors=True)  # of a run that was killed
            try:
                self._mark(case, used)
                done = [_current(stage, case, used, replace and stage.name == last, heard) for stage in wanted]
                _keep_settings(case, used)
            finally:
                shutil.rmtree(case.path(_WORK), ignore_errors=True)
                with suppress(Exception):  # the reason why this ends matters more than a mark that fails too
                    self._mark(case, case.settings())
        names = [stage.name for stage in wanted]
        return RunResult(
            dict(zip(names, (seconds for seconds, _ in done), strict=True)),
            {name: record.facts for name, (_, record) in zip(names, done, strict=True) if record is not None},
        )

    def replace(self, case: Case, name: str, write: Callable[[Path], None]) -> None:
        """Put a file that a person corrected into a case, as `replace_together` does."""
        self.replace_together(case, {name: write})

    def replace_together(self, case: Case, writers: Mapping[str, Callable[[Path], None]]) -> None:
        """Put files into a case, all or none; those before stay beside them, named `previous-…`.

        Args:
            case: the case.
            writers: by the file, relative to the case folder, what writes it to the path that it is given.

        Raises:
            BadInput: the case cannot be written.
            WriteFailed: the disk is full or failing.
        """
        case.check_writable()
        with exclusive(case.folder), _disk_errors_as_sentences(case):
            work = case.path(_WORK)
            shutil.rmtree(work, ignore_errors=True)
            moves: list[tuple[Path, Path]] = []
            try:
                for name, write in writers.items():
                    place = case.path(name)
                    (work / name).parent.mkdir(parents=True, exist_ok=True)
                    write(work / name)
                    moves += [(place, previous(place))] if place.exists() else []
                    moves.append((work / name, place))
                put_in_place(moves, work)
                self._mark(case, case.settings())
            finally:
                shutil.rmtree(work, ignore_errors=True)

    def restore(self, case: Case, name: str) -> None:
        """Put the file back that was replaced; what replaced it is gone.

        Raises:
            BadInput: the case cannot be written.
            WriteFailed: the disk is failing.
        """
        case.check_writable()
        with exclusive(case.folder), _disk_errors_as_sentences(case):
            previous(case.path(name)).replace(case.path(name))
            self._mark(case, case.settings())

    def outdated(self, case: Case) -> dict[str, str]:
        """Stages whose results are out of date: name → why, in a few words."""
        return outdated(self._stages, case, case.settings())

    def _needed(self, last: str) -> tuple[Stage, ...]:
        """A stage and those before it that make what it reads, directly or not."""
        wanted: list[Stage] = []
        read: set[str] = set()
        for stage in reversed(self._stages[: self.names.index(last) + 1]):
            if stage.name == last or read & set(stage.outputs):
                wanted.insert(0, stage)
                read |= set(stage.inputs)
        return tuple(wanted)

    def _mark(self, case: Case, settings: Settings) -> None:
        """Say beside the results which of them are out of date, so that nobody takes them for current."""
        reasons = outdated(self._stages, case, settings)
        concerned = [
            stage.name
            for stage in self._stages
            if stage.name in reasons and any(name.startswith(RESULTS) and case.has(name) for name in stage.outputs)
        ]
        mark = case.path(STALE)
        if not concerned:
            mark.unlink(missing_ok=True)
            return
        lines = [f"- {name}: {reason}" for name, reason in reasons.items()]
        text = "These results are out of date; bring them up to date with: glisson run CASE\n" + "\n".join(lines) + "\n"
        if not mark.exists() or mark.read_text(encoding="utf-8") != text:
            mark.write_text(text, encoding="utf-8")


def _require_effect(stages: Sequence[Stage], case: Case, settings: Settings) -> None:
    """Refuse new settings of a stage whose outputs a person gave, which would stay as they are."""
    before = case.settings()
    for stage in stages:
        if stage.settings(settings) != stage.settings(before):
            state = stage_state(stage, case, settings)
            if state.state is State.GIVEN:
                raise BadInput(
                    f"Other settings of the stage {stage.name} have no effect, because {state.reason}; edit that, or "
                    "remove it to have it made anew."
                )


def _current(
    stage: Stage, case: Case, settings: Settings, replace: bool, heard: Listener
) -> tuple[float, StageRecord | None]:
    """Run a stage unless it is current; seconds and record (None where a person gave the outputs)."""
    found = stage_state(stage, case, settings)
    kept = found.state is State.GIVEN and not (replace or stage.works_on_given(settings))
    if found.state is State.CURRENT or kept:
        heard.skipped(stage.name, found.reason)
        return 0.0, found.record
    given = found.state is State.GIVEN and not replace
    progress = heard.begun(stage.name, "what was given must be checked" if given else found.reason)
    work = case.path(_WORK)
    started = time.perf_counter()
    for name in (*stage.outputs, stage.record_name):
        (work / name).parent.mkdir(parents=True, exist_ok=True)
    basis = stage.basis(case, settings)
    facts = stage.run(case, settings, work, progress)
    seconds = time.perf_counter() - started
    outputs = {name: content_hash(work / name) for name in stage.outputs}
    record = record_of(stage.name, basis, outputs, facts, seconds, settings.seed)
    (work / stage.record_name).write_text(record.text(), encoding="utf-8")
    moves = [(work / name, case.path(name)) for name in (*stage.outputs, stage.record_name)]
    if settings != case.settings():
        moves.append(_staged_settings(case, settings))
    if found.state is State.GIVEN:
        there = [case.path(name) for name in stage.outputs if case.has(name)]
        lost = [place for place in there if content_hash(place) not in outputs.values()]
        moves = [(place, previous(place)) for place in lost] + moves
    put_in_place(moves, work)
    shutil.rmtree(work, ignore_errors=True)
    heard.ended(stage.name, seconds)
    return seconds, record


def previous(place: Path) -> Path:
    """Where the file that was replaced lies."""
    return place.with_name(f"previous-{place.name}")


def _keep_settings(case: Case, settings: Settings) -> None:
    if settings != case.settings():
        case.path(_WORK).mkdir(exist_ok=True)
        put_in_place([_staged_settings(case, settings)], case.path(_WORK))


def _staged_settings(case: Case, settings: Settings) -> tuple[Path, Path]:
    place, staged = case.path(SETTINGS), case.path(_WORK) / SETTINGS
    staged.write_text(settings_text(settings, place.read_text(encoding="utf-8")), encoding="utf-8")
    return staged, place


@contextmanager
def _disk_errors_as_sentences(case: Case) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        if error.errno in (errno.ENOSPC, errno.EDQUOT):
            where = error.filename or case.folder
            raise WriteFailed(f"The disk is full at {where}: free some space and run again.") from error
        if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
            where = error.filename or case.folder
            raise BadInput(f"{where} cannot be used: {error.strerror}.") from error
        raise
