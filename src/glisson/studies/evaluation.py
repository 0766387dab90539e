"""Computes one point, in whatever process or machine that may be."""

import json
import time
import traceback
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path

from glisson.core.errors import BadInput, GlissonError, StageFailed
from glisson.core.status import Status
from glisson.framework.hashing import source_hash
from glisson.studies.point import Outcome, Point
from glisson.studies.threads import limit_threads


class UnfitWorker(GlissonError):
    """A worker cannot compute points at all: another Glisson, or no way to the study's folder."""

    exit_code = 2


@dataclass(frozen=True)
class Work:
    """A point on its way to a worker, in plain values; `folder` is that of the study's points."""

    function: str
    packages: tuple[str, ...]
    source: str
    inputs: str
    folder: str
    threads: int


def work_of(point: Point, folder: Path, threads: int) -> Work:
    """What a worker is told of a point."""
    task = point.task
    return Work(
        task.function, task.packages, task.source, json.dumps(dict(point.inputs)), str(folder.resolve()), threads
    )


def evaluate(work: Work) -> Outcome:
    """Compute a point; one that fails has an outcome that says so.

    Raises:
        UnfitWorker: it is not the point that failed.
    """
    limit_threads(work.threads)
    folder = Path(work.folder)
    if not folder.is_dir():
        raise UnfitWorker(f"A worker does not see {folder}; choose a folder on a file system that all workers share.")
    if source_hash(*work.packages) != work.source:
        raise UnfitWorker("A worker runs another version of Glisson; install the same one everywhere and restart it.")
    module, _, name = work.function.partition(":")
    started = time.perf_counter()
    try:
        outcome: Outcome = getattr(import_module(module), name)(json.loads(work.inputs), folder)
    except StageFailed as error:
        outcome = Outcome(status=error.status, message=str(error))
    except BadInput as error:
        outcome = Outcome(status=Status.BAD_INPUT, message=str(error))
    except MemoryError:
        outcome = Outcome(status=None, message="There was not enough memory.")
    except OSError as error:
        raise UnfitWorker(f"A worker could not read or write: {error}.") from error
    except Exception as error:
        outcome = Outcome(status=None, message=_unforeseen(error))
    return replace(outcome, seconds=round(time.perf_counter() - started, 3))


def _unforeseen(error: Exception) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1]
    what = f"{type(error).__name__}: {' '.join(str(error).split())}; {last.name}, line {last.lineno}"
    return f"It failed in a way that was not foreseen ({what})."
