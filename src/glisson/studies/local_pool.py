"""A pool of processes on this machine.

Unlike the pools of the standard library it knows which point a worker had when it was killed (usually for
want of memory): that point has failed, the others go on.
"""

import multiprocessing
import signal
import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from types import FrameType

from glisson.framework.interruptions import interruptions_held
from glisson.studies.evaluation import UnfitWorker, Work, evaluate
from glisson.studies.point import Outcome
from glisson.studies.threads import cores

_PATIENCE_S = 5.0
"""How long a worker that was asked to end may take before it is killed."""


@dataclass(eq=False)
class _Worker:
    process: SpawnProcess
    connection: Connection
    key: str | None = None


class LocalPool:
    """An `Executor` of `size` processes (default: one for each core)."""

    def __init__(self, size: int | None = None) -> None:
        self._size = cores() if size is None else size
        self._workers: list[_Worker] = []
        self._ended: list[tuple[str, Outcome]] = []

    @property
    def capacity(self) -> int:
        """Number of processes."""
        return self._size

    @property
    def threads(self) -> int:
        """The share of each process in the machine's cores."""
        return max(1, cores() // self._size)

    def submit(self, key: str, work: Work) -> None:
        """Begin a point in a process that has none."""
        idle = (worker for worker in self._workers if worker.key is None and worker.process.is_alive())
        worker = next(idle, None)
        if worker is None:
            with interruptions_held():  # no worker is lost, and none takes a Ctrl-C for its own
                worker = _start()
                self._workers.append(worker)
        worker.key = key
        worker.connection.send(work)

    def finished(self, timeout: float) -> list[tuple[str, Outcome]]:
        """Points that have ended."""
        busy = {worker.connection: worker for worker in self._workers if worker.key is not None}
        for connection in wait(list(busy), timeout):
            self._receive(busy[connection])  # type: ignore[index]  # only connections were waited for
        ended, self._ended = self._ended, []
        return ended

    def _receive(self, worker: _Worker) -> None:
        """Take a worker's answer; Ctrl-C meanwhile loses none that is complete."""
        assert worker.key is not None  # it was busy
        try:
            answer: Outcome | UnfitWorker = worker.connection.recv()
        except (EOFError, OSError):
            self._workers.remove(worker)
            answer = _killed(worker)
        except KeyboardInterrupt:
            # Half an answer was read; nobody may ask for the rest.
            self._workers.remove(worker)
            worker.process.terminate()
            raise
        if isinstance(answer, UnfitWorker):
            raise answer
        self._ended.append((worker.key, answer))
        worker.key = None

    def close(self) -> None:
        """End all processes: those that wait for work at the end of their connection, the others at once."""
        for worker in self._workers:
            worker.connection.close()
            if worker.key is not None:
                worker.process.terminate()
        for worker in self._workers:
            worker.process.join(_PATIENCE_S)
            worker.process.kill()
            worker.process.join()
        self._workers.clear()


def _start() -> _Worker:
    # A fresh interpreter: a fork would inherit threads of BLAS and numba that no longer run.
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_serve, args=(theirs,), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process, ours)


def _serve(connection: Connection) -> None:
    """A worker: one point after another, until nobody asks any more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # An exception, so that a mesher that runs as a child of this process ends with it.
    signal.signal(signal.SIGTERM, _end)
    try:
        while True:
            work: Work = connection.recv()
            try:
                answer: Outcome | UnfitWorker = evaluate(work)
            except UnfitWorker as error:
                answer = error
            connection.send(answer)
    except (EOFError, BrokenPipeError, ConnectionResetError):
        return


def _end(number: int, frame: FrameType | None) -> None:
    sys.exit(128 + number)


def _killed(worker: _Worker) -> Outcome:
    worker.process.join(_PATIENCE_S)
    code = worker.process.exitcode
    how = f"signal {-code}" if code is not None and code < 0 else f"exit code {code}"
    return Outcome(status=None, message=f"Its process ended with {how}, probably for want of memory.")
