"""Benchmarks: the scripts in `benchmarks/` of a checkout, each run in a process of its own."""

import os
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import glisson
from glisson.core.errors import BadInput
from glisson.core.protocols import Progress

_POLL_S = 0.05
_GRACE_S = 5.0


def benchmarks_folder(name: str) -> Path:
    """The folder of one benchmark's scripts, or of those that all share.

    Raises:
        BadInput: Glisson was installed from a wheel, which has none.
    """
    folder = Path(glisson.__file__).resolve().parents[2] / "benchmarks" / name
    if not folder.is_dir():
        raise BadInput(
            "Benchmarks are scripts in a checkout of Glisson's repository and this Glisson was installed without them; "
            "clone the repository and run make bench there."
        )
    return folder


def run_script(
    command: Sequence[str],
    log: Path,
    time_limit_s: float,
    progress: Progress,
    words: str,
    surroundings: Mapping[str, str],
) -> str | None:
    """Run a command to its end with its output in `log`; why it gave nothing, or None where it ended well.

    `surroundings` are environment variables beside those of this process.

    It and whatever it started are ended when it takes too long and when this process is interrupted.
    """
    start = time.monotonic()
    with log.open("wb") as output:
        try:
            process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=output,
                start_new_session=True,
                env={**os.environ, **surroundings},
            )
        except OSError as error:
            return f"{command[0]} could not be started: {error.strerror}"
        try:
            while process.poll() is None:
                seconds = time.monotonic() - start
                if seconds > time_limit_s:
                    return f"no answer within {time_limit_s:g} s"
                progress(None, f"{words}, {seconds:.0f} s")
                time.sleep(_POLL_S)
        finally:
            _end(process)
    return None if process.returncode == 0 else _last_words(log, process.returncode)


def _end(process: subprocess.Popen[bytes]) -> None:
    """End a process and all of its session, first kindly."""
    for number in (signal.SIGTERM, signal.SIGKILL):
        if process.poll() is None:
            os.killpg(process.pid, number)
            try:
                process.wait(_GRACE_S)
            except subprocess.TimeoutExpired:
                continue


def _last_words(log: Path, code: int) -> str:
    lines = [line.strip() for line in log.read_text(errors="replace").splitlines() if line.strip()]
    said = f"ended by signal {-code}" if code < 0 else f"ended with exit code {code}"
    return f"{said}: {lines[-1][:300]}" if lines else said
