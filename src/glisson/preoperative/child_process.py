"""A program of its own: watched, told of, given up after a time, and killed when this process is interrupted."""

import subprocess
import time
from pathlib import Path

from glisson.core.protocols import Progress

_BETWEEN_LOOKS_S = 0.05


def run_child(
    command: list[str], folder: Path, message: str, progress: Progress, time_limit_s: float = float("inf")
) -> tuple[int, str]:
    """Run a program in `folder` to its end: its exit code, and the last line that it said ("" if none).

    Args:
        command: the program and its arguments.
        folder: where it runs; what it says is kept there as log.txt.
        message: told to `progress` with the seconds since the start.
        progress: told of the work while it goes on.
        time_limit_s: after which it is killed.

    Raises:
        TimeoutError: it was killed after the time limit; the sentence says after how long.
    """
    start, log_path = time.monotonic(), folder / "log.txt"
    with (
        log_path.open("wb") as log,
        subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=folder) as child,
    ):
        try:
            while child.poll() is None:
                seconds = time.monotonic() - start
                if seconds > time_limit_s:
                    raise TimeoutError(f"given up after {seconds:.0f} s")
                progress(None, f"{message}, {seconds:.0f} s")
                time.sleep(_BETWEEN_LOOKS_S)
        finally:
            child.kill()
    lines = log_path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return child.returncode, lines[-1].strip() if lines else ""
