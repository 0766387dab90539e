"""The runner of studies: each point once, whatever ends it, and whoever else runs the same study."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from glisson.core.errors import BadInput
from glisson.core.status import Status
from glisson.framework.hashing import source_hash
from glisson.studies.dask_cluster import DaskCluster
from glisson.studies.evaluation import UnfitWorker, work_of
from glisson.studies.executor import Executor
from glisson.studies.local_pool import LocalPool
from glisson.studies.point import Outcome, Point, Task
from glisson.studies.runner import StudyInterrupted, run_points
from glisson.studies.store import PointStore, read_arrays

TASKS = """
import os, signal, time
from pathlib import Path
import numpy as np
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.studies.point import Outcome

def square(inputs, folder):
    with open(inputs["log"], "a") as log:
        log.write(f"{inputs['number']}\\n")
    time.sleep(inputs.get("seconds", 0.0))
    how = inputs.get("how")
    if how == "stagnates":
        raise StageFailed("It did not converge.", Status.STAGNATED)
    if how == "bad":
        raise BadInput("The lever is nowhere.")
    if how == "slip":
        raise ZeroDivisionError("a slip")
    if how == "memory":
        raise MemoryError
    if how == "killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if how == "unreadable":
        Path("/no/such/file").read_text()
    if how == "threads":
        import numba
        return Outcome({"square": numba.get_num_threads()})
    return Outcome({"square": inputs["number"] ** 2}, {"numbers": np.arange(inputs["number"])})
"""

DRIVER = """
import json, sys
from pathlib import Path
from glisson.studies.local_pool import LocalPool
from glisson.studies.point import Point, Task
from glisson.studies.runner import run_points
from glisson.studies.store import PointStore

if __name__ == "__main__":
    folder, log, count, seconds = Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
    task = Task("study_tasks:square", ("study_tasks",))
    points = [Point(task, {"number": n, "log": log, "seconds": seconds}) for n in range(count)]
    pool = LocalPool(2)
    try:
        done = run_points(points, PointStore(folder), pool)
    except KeyboardInterrupt as error:
        print(error)
        sys.exit(130)
    finally:
        pool.close()
    print(json.dumps([outcome.values["square"] for outcome in done.values()]))
"""


@pytest.fixture
def tasks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A module of tasks that workers can import."""
    module = tmp_path / "study_tasks.py"
    module.write_text(TASKS)
    (tmp_path / "drive.py").write_text(DRIVER)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    source_hash.cache_clear()
    yield module
    sys.modules.pop("study_tasks", None)
    source_hash.cache_clear()


@pytest.fixture
def store(tmp_path: Path) -> PointStore:
    made = PointStore(tmp_path / "study" / "points")
    made.prepare()
    return made


@pytest.fixture
def pool() -> Iterator[LocalPool]:
    made = LocalPool(2)
    yield made
    made.close()


def point(tmp_path: Path, number: int, **how: object) -> Point:
    task = Task("study_tasks:square", ("study_tasks",))
    return Point(task, {"number": number, "log": str(tmp_path / "log"), **how})


def computed(tmp_path: Path) -> list[int]:
    """Numbers of the points that were computed, in order; a number twice was computed twice."""
    log = tmp_path / "log"
    return [int(line) for line in log.read_text().split()] if log.exists() else []


def test_all_points_are_done_once_and_their_outcomes_kept(tasks, store, pool, tmp_path):
    points = [point(tmp_path, n) for n in range(5)]
    done = run_points([*points, points[0]], store, pool)
    assert [done[p.key].values["square"] for p in points] == [0, 1, 4, 9, 16]
    assert sorted(computed(tmp_path)) == list(range(5))
    again = run_points([*points, point(tmp_path, 7)], store, pool)
    assert [outcome.values["square"] for outcome in again.values()] == [0, 1, 4, 9, 16, 49]
    assert sorted(computed(tmp_path)) == [0, 1, 2, 3, 4, 7]
    np.testing.assert_array_equal(read_arrays(store.folder, points[4].key)["numbers"], np.arange(4))
    assert not list(store.folder.glob(".*"))


def test_a_key_is_of_inputs_and_source(tasks, tmp_path):
    assert point(tmp_path, 1).key == point(tmp_path, 1).key
    assert point(tmp_path, 1).key != point(tmp_path, 2).key
    before = point(tmp_path, 1).key
    tasks.write_text(TASKS + "# changed\n")
    source_hash.cache_clear()
    assert point(tmp_path, 1).key != before


def test_a_changed_source_computes_anew(tasks, store, tmp_path):
    first = LocalPool(1)
    run_points([point(tmp_path, 3)], store, first)
    first.close()
    tasks.write_text(TASKS.replace("** 2", "** 3"))
    source_hash.cache_clear()
    second = LocalPool(1)
    changed = point(tmp_path, 3)
    assert run_points([changed], store, second)[changed.key].values["square"] == 27
    second.close()
    assert computed(tmp_path) == [3, 3]


@pytest.mark.parametrize(
    ("how", "status", "words"),
    [
        ("stagnates", Status.STAGNATED, "did not converge"),
        ("bad", Status.BAD_INPUT, "lever is nowhere"),
        ("slip", None, "ZeroDivisionError"),
        ("memory", None, "not enough memory"),
        ("killed", None, "signal 9"),
    ],
)
def test_a_point_that_fails_is_kept_and_the_others_go_on(tasks, store, pool, tmp_path, how, status, words):
    points = [point(tmp_path, 1, how=how), point(tmp_path, 2), point(tmp_path, 3)]
    for _ in range(2):
        failed, *others = run_points(points, store, pool).values()
        assert failed.status == status
        assert not failed.is_good
        assert words in failed.message
        assert [outcome.values["square"] for outcome in others] == [4, 9]
    assert sorted(computed(tmp_path)) == [1, 2, 3]


def test_a_worker_that_cannot_work_ends_the_run_and_leaves_no_outcome(tasks, store, pool, tmp_path):
    unreadable = point(tmp_path, 1, how="unreadable")
    with pytest.raises(UnfitWorker, match="/no/such/file"):
        run_points([unreadable], store, pool)
    assert store.outcome(unreadable) is None
    assert not list(store.folder.iterdir())


def test_a_worker_of_another_version_is_refused(tasks, store, pool, tmp_path):
    asked = point(tmp_path, 1)
    assert asked.key
    tasks.write_text(TASKS + "# changed after it was asked for\n")
    with pytest.raises(UnfitWorker, match="another version"):
        run_points([asked], store, pool)


def test_workers_share_the_cores(tasks, store, tmp_path):
    pool = LocalPool(os.cpu_count())
    assert pool.threads == 1
    asked = point(tmp_path, 1, how="threads")
    assert run_points([asked], store, pool)[asked.key].values["square"] == 1
    pool.close()


def test_a_damaged_outcome_is_done_again(tasks, store, pool, tmp_path):
    asked = point(tmp_path, 3)
    run_points([asked], store, pool)
    (store.folder / f"{asked.key}.json").write_text('{"status": "conv')
    assert run_points([asked], store, pool)[asked.key].values["square"] == 9
    (store.folder / f"{asked.key}.npz").unlink()
    run_points([asked], store, pool)
    assert computed(tmp_path) == [3, 3, 3]


def test_what_is_not_done_in_time_is_missing_and_done_later(tasks, store, pool, tmp_path):
    points = [point(tmp_path, 0), *(point(tmp_path, n, seconds=60.0) for n in (1, 2))]
    started = time.monotonic()
    done = run_points(points, store, pool, seconds=8.0)
    assert time.monotonic() - started < 20.0
    assert list(done) == [points[0].key]
    assert not list(store.folder.glob(".*"))


def test_a_first_point_is_waited_for_whatever_the_time(tasks, store, pool, tmp_path):
    points = [point(tmp_path, 1, seconds=3.0), *(point(tmp_path, n, seconds=60.0) for n in (2, 3))]
    assert list(run_points(points, store, pool, seconds=0.5)) == [points[0].key]
    assert sorted(computed(tmp_path)) == [1, 2]


def test_the_forecast_is_of_costs_left(tasks, store, pool, tmp_path):
    said: list[tuple[float | None, str]] = []
    task = Task("study_tasks:square", ("study_tasks",))
    log = str(tmp_path / "log")
    points = [Point(task, {"number": n, "log": log, "seconds": 1.0}, cost=1.0 if n < 2 else 1000.0) for n in range(4)]
    run_points(points, store, pool, lambda fraction, words: said.append((fraction, words)))
    halfway = [words for fraction, words in said if fraction == 0.5]
    assert any("2 of 4 points, about" in words for words in halfway)
    # Two points of cost 1 took a second each: two of cost 1000, side by side, will take a thousand seconds.
    assert any(words.endswith("about 17 min left") for words in halfway)
    assert said[-1][0] == 1.0


def drive(tmp_path: Path, count: int, seconds: float) -> "subprocess.Popen[str]":
    command = [sys.executable, str(tmp_path / "drive.py"), str(tmp_path / "study/points"), str(tmp_path / "log")]
    return subprocess.Popen(
        [*command, str(count), str(seconds)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_two_processes_share_the_points_and_both_have_all(tasks, store, tmp_path):
    both = [drive(tmp_path, 12, 0.4) for _ in range(2)]
    for process in both:
        out, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
        assert json.loads(out) == [n * n for n in range(12)]
    assert sorted(computed(tmp_path)) == list(range(12))
    assert not list(store.folder.glob(".*"))


@pytest.mark.parametrize("to_all", [True, False])
def test_an_interruption_keeps_what_is_done_and_nothing_half(tasks, store, tmp_path, to_all):
    running = drive(tmp_path, 8, 1.0)
    wait_until(lambda: len(list(store.folder.glob("*.json"))) >= 2)
    if to_all:
        os.killpg(running.pid, signal.SIGINT)  # as a terminal does
    else:
        running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=30)
    assert running.returncode == 130, err
    assert "Traceback" not in err
    kept = len(list(store.folder.glob("*.json")))
    assert f"{kept} of 8 points are done" in out
    assert not list(store.folder.glob(".*"))
    wait_until(lambda: not group_lives(running.pid))
    begun = computed(tmp_path)
    done = {n for n in range(8) if store.outcome(point(tmp_path, n, seconds=1.0)) is not None}
    again = drive(tmp_path, 8, 1.0)
    out, err = again.communicate(timeout=60)
    assert json.loads(out) == [n * n for n in range(8)]
    # What was kept is not done again, what was not is.
    assert sorted(computed(tmp_path)[len(begun) :]) == sorted(set(range(8)) - done)


def test_a_run_that_was_killed_is_no_obstacle(tasks, store, tmp_path):
    running = drive(tmp_path, 3, 2.0)
    wait_until(lambda: bool(computed(tmp_path)))
    os.killpg(running.pid, signal.SIGKILL)
    running.communicate()
    assert list(store.folder.glob(".*.lock"))
    out, err = drive(tmp_path, 3, 0.0).communicate(timeout=60)
    assert json.loads(out) == [0, 1, 4], err


def group_lives(leader: int) -> bool:
    try:
        os.killpg(leader, 0)
    except ProcessLookupError:
        return False
    return True


def wait_until(holds) -> None:
    end = time.monotonic() + 60.0
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_interruption_in_this_process(tasks, store, tmp_path):
    """Also where Ctrl-C reaches the runner itself, and not a process of its own."""
    points = [point(tmp_path, 1)]

    class Interrupting(LocalPool):
        def submit(self, key, work) -> None:
            raise KeyboardInterrupt

    with pytest.raises(StudyInterrupted, match="0 of 1 points"):
        run_points(points, store, Interrupting(1))
    assert not list(store.folder.iterdir())


def test_the_same_points_on_a_dask_cluster(tasks, store, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        executor: Executor = DaskCluster(cluster.scheduler_address)
        points = [point(tmp_path, 1, how="stagnates"), *(point(tmp_path, n) for n in range(2, 6))]
        failed, *others = run_points(points, store, executor).values()
        assert failed.status is Status.STAGNATED
        assert [outcome.values["square"] for outcome in others] == [4, 9, 16, 25]
        assert sorted(computed(tmp_path)) == [1, 2, 3, 4, 5]
        assert run_points(points, store, executor)[points[1].key].values["square"] == 4
        assert sorted(computed(tmp_path)) == [1, 2, 3, 4, 5]
        slow = point(tmp_path, 9, seconds=60.0)
        assert list(run_points([points[1], slow], store, executor, seconds=2.0)) == [points[1].key]
        assert not list(store.folder.glob(".*"))
        executor.close()  # for the second time


def test_dask_workers_with_several_threads_are_refused(tasks, store, tmp_path):
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=2, processes=True, dashboard_address=None, silence_logs=50
    ) as cluster:
        executor = DaskCluster(cluster.scheduler_address)
        with pytest.raises(UnfitWorker, match="--nthreads 1"):
            run_points([point(tmp_path, 1)], store, executor)
        executor.close()


def test_no_scheduler_is_a_sentence():
    with pytest.raises(BadInput, match=r"Dask"):
        DaskCluster("tcp://127.0.0.1:9")


def test_inputs_must_be_plain():
    with pytest.raises(ValueError, match=r"not JSON compliant|Out of range"):
        Point(Task("a:b", ()), {"x": float("nan")})
    assert Outcome().is_good
    plain = Point(Task("a:b", ()), {"x": (1, 2)})
    assert plain.inputs["x"] == [1, 2]
    assert json.loads(work_of(plain, Path(), 1).inputs) == {"x": [1, 2]}
