"""What a study is, and how one is run: preparations, points, conclusion."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any, ClassVar, Protocol

from glisson.framework.pipeline import Listener
from glisson.io.atomic import atomic_path
from glisson.studies.executor import Executor
from glisson.studies.point import Outcome, Point
from glisson.studies.runner import run_points
from glisson.studies.store import PointStore

POINTS = "points"
"""Folder of the outcomes in a study's folder."""

QUICK_SECONDS = 55.0
"""The quick form begins nothing more after this time, and is at its end within a minute."""


@dataclass(frozen=True)
class Conclusion:
    """What a study has found: `values` for machines, `text` for people, and `files` by name, in bytes."""

    values: Mapping[str, Any]
    text: str
    files: Mapping[str, bytes] = field(default_factory=dict)


class Study(Protocol):
    """Points and what they tell. Preparations are points, too: meshes and truths that others go on with."""

    name: ClassVar[str]

    def preparations(self) -> Sequence[Point]:
        """What must be there before."""

    def points(self, prepared: Mapping[str, Outcome]) -> Sequence[Point]:
        """The points, the most telling ones first; `prepared` has the preparations by their keys.

        Raises:
            StageFailed: without a preparation that failed there is no study.
        """

    def conclude(self, prepared: Mapping[str, Outcome], done: Mapping[str, Outcome]) -> Conclusion:
        """What the points say; in the quick form some may be missing in `done`."""


def run_study(
    study: Study, folder: Path, executor: Executor, listener: Listener, quick: bool
) -> tuple[Conclusion, dict[str, float]]:
    """Run a study in a folder; its conclusion, and the seconds of this run for set-up and points.

    Raises:
        StudyInterrupted: Ctrl-C; what had ended is kept.
        StageFailed, BadInput, WriteFailed: there is no conclusion.
    """
    store = PointStore(folder / POINTS)
    store.prepare()
    seconds: dict[str, float] = {}

    def run(name: str, points: Sequence[Point], limit: float | None) -> dict[str, Outcome]:
        missing = sum(store.outcome(point) is None for point in points)
        if not missing:
            listener.skipped(name, f"all {len(points)} points are there")
            seconds[name] = 0.0
            return run_points(points, store, executor)
        started = perf_counter()
        progress = listener.begun(name, f"{missing} of {len(points)} points are not there yet")
        done = run_points(points, store, executor, progress, limit)
        seconds[name] = perf_counter() - started
        listener.ended(name, seconds[name])
        return done

    prepared = run("set-up", study.preparations(), None)
    done = run("points", study.points(prepared), QUICK_SECONDS if quick else None)
    conclusion = study.conclude(prepared, done)
    for name, content in conclusion.files.items():
        with atomic_path(folder / name) as temporary:
            temporary.write_bytes(content)
    return conclusion, seconds
