"""Does the points of a study that have not been done, each exactly once, and keeps what came of them."""

import time
from collections import deque
from collections.abc import Iterable, Sequence

from glisson.core.protocols import Progress, silent
from glisson.framework.interruptions import interruptions_held
from glisson.framework.lock import Claim
from glisson.studies.evaluation import work_of
from glisson.studies.executor import Executor
from glisson.studies.point import Outcome, Point
from glisson.studies.store import PointStore

_POLL_S = 0.2
_LOOK_AGAIN_S = 1.0
"""How often one looks for points that another process has."""


class StudyInterrupted(KeyboardInterrupt):
    """Ctrl-C in a study; its text says what is kept."""


def run_points(
    points: Sequence[Point],
    store: PointStore,
    executor: Executor,
    progress: Progress = silent,
    seconds: float | None = None,
) -> dict[str, Outcome]:
    """Outcomes of all points by their keys, in the points' order.

    Points that are stored are not done again, nor are those that another process is doing: these are waited
    for. A point that failed is done, too.

    Args:
        points: what is wanted.
        store: where outcomes are kept.
        executor: computes the points.
        progress: told how far it is and how long it may still take.
        seconds: after this time nothing more is begun, and what is being computed is given up, unless nothing
            at all is done yet: then a first one is waited for. Points that are not done are missing.

    Raises:
        StudyInterrupted: Ctrl-C; what had ended is kept, the rest is as if it had never begun.
        UnfitWorker: a worker cannot compute points at all.
        WriteFailed: the disk is full or failing.
    """
    run = _Run(points, store, executor, progress)
    try:
        run.go(None if seconds is None else time.monotonic() + seconds)
    except KeyboardInterrupt:
        run.collect(0.0)
        raise StudyInterrupted(
            f"Interrupted; {run.words} are done and kept. Run the same command again to go on."
        ) from None
    finally:
        run.give_up()
    return {point.key: run.done[point.key] for point in points if point.key in run.done}


class _Run:
    """The state of a run: a point waits, is being computed here or elsewhere, or is done."""

    def __init__(self, points: Sequence[Point], store: PointStore, executor: Executor, progress: Progress) -> None:
        self._all = {point.key: point for point in points}
        self._store, self._executor, self._progress = store, executor, progress
        self.done: dict[str, Outcome] = {}
        for key, point in self._all.items():
            self._take_stored(key, point)
        self._waiting = deque(key for key in self._all if key not in self.done)
        self._elsewhere: deque[str] = deque()
        self._running: dict[str, Claim] = {}
        self._begun: dict[str, float] = {}
        self._ended: deque[tuple[str, Outcome]] = deque()  # not kept yet
        self._looked = time.monotonic()

    @property
    def words(self) -> str:
        """How many points are done."""
        return f"{len(self.done)} of {len(self._all)} points"

    def go(self, deadline: float | None) -> None:
        """Compute what is missing."""
        while len(self.done) < len(self._all):
            if deadline is None or time.monotonic() < deadline:
                self._begin()
            elif self.done or not self._running:
                return
            self.collect(_POLL_S)
            if not self._running and self._elsewhere:
                time.sleep(_POLL_S)
            if time.monotonic() - self._looked >= _LOOK_AGAIN_S:
                self._look_elsewhere()
            self._progress(len(self.done) / len(self._all), self._forecast())

    def collect(self, timeout: float) -> None:
        """Keep what has ended."""
        if not self._running:
            return
        self._ended.extend(self._executor.finished(timeout))
        while self._ended:
            key, outcome = self._ended[0]
            self._store.keep(self._all[key], outcome)
            self._ended.popleft()
            self.done[key] = outcome
            with interruptions_held():
                self._running.pop(key).release()
            del self._begun[key]

    def give_up(self) -> None:
        """End what is being computed; others may have it."""
        if self._running:
            self._executor.close()
        for claim in self._running.values():
            claim.release()
        self._running.clear()

    def _begin(self) -> None:
        while self._waiting and len(self._running) < self._executor.capacity:
            key = self._waiting.popleft()
            point = self._all[key]
            with interruptions_held():  # else a claim that nobody knows of would be left
                claim = self._store.claim(point)
                if claim is None:
                    self._elsewhere.append(key)
                    continue
                # Another process may have ended it between the last look and the claim.
                if self._take_stored(key, point):
                    claim.release()
                    continue
                self._running[key], self._begun[key] = claim, time.monotonic()
            self._executor.submit(key, work_of(point, self._store.folder, self._executor.threads))

    def _look_elsewhere(self) -> None:
        """Take what other processes have done; what they gave up waits again."""
        self._looked = time.monotonic()
        for _ in range(len(self._elsewhere)):
            key = self._elsewhere.popleft()
            if not self._take_stored(key, self._all[key]):
                self._waiting.append(key)

    def _take_stored(self, key: str, point: Point) -> bool:
        found = self._store.outcome(point)
        if found is not None:
            self.done[key] = found
        return found is not None

    def _forecast(self) -> str:
        """How many points are done, and how long the others may take at the pace of those."""
        spent = sum(outcome.seconds for outcome in self.done.values())
        if spent == 0.0:
            return self.words
        pace = spent / self._cost(self.done)
        now = time.monotonic()
        begun = sum(min(now - since, pace * self._all[key].cost) for key, since in self._begun.items())
        left = pace * self._cost(key for key in self._all if key not in self.done) - begun
        if left <= 0.0:  # those at work take longer than expected, and nobody knows how much longer
            return self.words
        return f"{self.words}, about {_duration(left / self._executor.capacity)} left"

    def _cost(self, keys: Iterable[str]) -> float:
        return sum(self._all[key].cost for key in keys)


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"{seconds:.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"
