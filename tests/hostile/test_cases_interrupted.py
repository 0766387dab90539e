"""Ctrl-C, a full disk and a crash in any stage: one sentence, and the case as it was."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from glisson.cli.main import main
from glisson.core.protocols import Progress
from glisson.framework.case import SCENARIO, STALE, Case
from glisson.framework.settings import Settings
from glisson.framework.stages import STAGES
from small_case import contents, make_small_case, offer_bending, small_settings

NAMES = tuple(stage.name for stage in STAGES)


@pytest.fixture(scope="module")
def finished(meshed_small_case: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small case with all its results."""
    folder = tmp_path_factory.mktemp("finished") / "case"
    shutil.copytree(meshed_small_case, folder)
    with pytest.MonkeyPatch.context() as patch:
        offer_bending(patch)
        assert main(["run", str(folder)]) == 0
    return folder


def outdated_from(finished: Path, folder: Path, stage: str) -> Path:
    """A copy in which `stage` must run, the stages before it need not, and the older results are there."""
    shutil.copytree(finished, folder)
    (folder / f"results/provenance/{stage}.json").unlink()
    if stage == "scenario":
        (folder / SCENARIO).unlink()  # it would count as written by hand
    return folder


def same_but_marked(before: Mapping[str, bytes], folder: Path) -> bool:
    after = contents(folder)
    after.pop(STALE, None)
    return after == before


@pytest.mark.parametrize("stage", NAMES)
@pytest.mark.parametrize(
    ("error", "exit_code", "words"),
    [
        (KeyboardInterrupt(), 130, "Interrupted in the stage"),
        (OSError(errno.ENOSPC, "No space left on device"), 1, "disk is full"),
        (KeyError("x"), 1, "not foreseen"),
    ],
)
def test_a_stage_that_breaks_off_leaves_the_case_as_it_was(
    finished: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    stage: str,
    error: BaseException,
    exit_code: int,
    words: str,
) -> None:
    offer_bending(monkeypatch)
    case = outdated_from(finished, tmp_path / "case", stage)
    before = contents(case)
    broken = next(made for made in STAGES if made.name == stage)

    def breaks(case: Case, settings: Settings, out: Path, progress: Progress) -> Mapping[str, Any]:
        for name in broken.outputs:
            target = out / name
            target.mkdir() if name == "mesh" else target.write_text("half")
        raise error

    monkeypatch.setattr(type(broken), "run", lambda self, *given: breaks(*given))
    code = main(["run", str(case), "--json"])
    out, err = capfd.readouterr()
    said = json.loads(out)
    assert code == exit_code
    assert words in said["message"]
    assert said["stage"] == stage
    assert "Traceback" not in err
    assert same_but_marked(before, case)
    # A given mask that waits for its check is still the one that the results rest on.
    assert (case / STALE).exists() == (stage != "segment")


@pytest.mark.parametrize("stage", NAMES)
def test_a_disk_that_fills_up_while_it_is_written_to(
    finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], stage: str
) -> None:
    """Every file is flushed before it counts; here the disk refuses that."""
    offer_bending(monkeypatch)
    case = outdated_from(finished, tmp_path / "case", stage)
    before = contents(case)

    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    code = main(["run", str(case), "--json"])
    said = json.loads(capfd.readouterr().out)
    assert code == 1
    assert "disk is full" in said["message"]
    assert same_but_marked(before, case)


@pytest.mark.skipif(os.geteuid() != 0 or shutil.which("mount") is None, reason="only root can make a small disk")
def test_a_disk_that_is_really_full(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    made = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=512k", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if made.returncode != 0:
        pytest.skip("a small disk cannot be mounted here")
    try:
        settings = small_settings().choosing("simulate", "quasi-static", {})
        case = make_small_case(disk / "case", settings)
        filler = disk / "filler"
        filler.write_bytes(b"\0" * (shutil.disk_usage(disk).free - 8192))
        before = contents(case.folder)
        ended = glisson("run", str(case.folder), "--json")
        assert ended.returncode == 1
        assert "disk is full" in json.loads(ended.stdout)["message"]
        assert "Traceback" not in ended.stderr
        assert same_but_marked(before, case.folder)
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)


@pytest.mark.parametrize("signalled", [signal.SIGINT, signal.SIGTERM])
def test_a_real_interruption_ends_a_mesh_at_once(tmp_path: Path, signalled: signal.Signals) -> None:
    settings = small_settings().choosing("simulate", "quasi-static", {}).choosing("mesh", None, {"edge_length_mm": 3.0})
    case = make_small_case(tmp_path / "case", settings)
    assert glisson("segment", str(case.folder)).returncode == 0
    before = contents(case.folder)
    words = [sys.executable, "-m", "glisson.cli.main", "run", str(case.folder), "--json"]
    running = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    assert running.stderr is not None
    for line in running.stderr:
        if line.startswith("mesh"):
            break
    time.sleep(1.5)
    interrupted = time.monotonic()
    if signalled == signal.SIGINT:
        os.killpg(running.pid, signalled)  # as a terminal does: to the whole group
    else:
        running.send_signal(signalled)
    out, err = running.communicate(timeout=30)
    assert time.monotonic() - interrupted < 10.0
    assert running.returncode == 130, out + err
    assert "Interrupted in the stage mesh" in json.loads(out)["message"]
    assert "Traceback" not in err
    assert contents(case.folder) == before
    with pytest.raises(ProcessLookupError):  # nobody of the group is left
        os.killpg(running.pid, 0)


def test_a_run_that_was_killed_is_no_obstacle(finished: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    offer_bending(monkeypatch)
    case = outdated_from(finished, tmp_path / "case", "navigate")
    (case / ".lock").write_text("999999999")
    (case / ".work/results").mkdir(parents=True)
    (case / ".work/results/results.json").write_text("{")
    assert main(["navigate", str(case)]) == 0
    assert json.loads((case / "results/results.json").read_text())["status"] == "converged"
    assert not list(case.glob(".*"))


def glisson(*words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "glisson.cli.main", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
