"""Running CalculiX (`ccx`) with a clock that starts when it has read its deck."""

import os
import pty
import re
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from measuring import Failed

_BEGIN = re.compile(rb"^ *STEP +1\s*$", re.MULTILINE)


@dataclass(frozen=True)
class Measured:
    """What CalculiX was and took: version, linear solves, seconds, memory in MB before the first step and at most."""

    version: str
    iterations: int
    seconds: float
    memory_before_mb: float
    memory_mb: float


def run_timed(deck: Path) -> Measured:
    """Run CalculiX on a deck in its folder, timed from the message with which it begins its first step.

    Raises:
        Failed: CalculiX gave no solution.
    """
    # On a terminal its messages come line by line.
    leader, follower = pty.openpty()
    threads = {"OMP_NUM_THREADS": str(os.cpu_count())}
    said, start, before, peak = b"", 0.0, 0.0, 0.0
    with subprocess.Popen(
        ["ccx", "-i", deck.stem], cwd=deck.parent, stdout=follower, stderr=follower, env={**os.environ, **threads}
    ) as process:
        os.close(follower)
        while chunk := _read(leader):
            said += chunk
            now, peak = _memory_mb(process.pid, (0.0, peak))
            if not start and _BEGIN.search(said):
                start, before = time.perf_counter(), now
    seconds = time.perf_counter() - start
    text = said.decode(errors="replace")
    if process.returncode != 0 or "Job finished" not in text:
        raise Failed(f"ccx ended with {process.returncode}: {' '.join(text.split()[-30:])}")
    version = re.search(r"CalculiX Version ([\d.]+)", text)
    iterations = len(re.findall(r"^ *iteration +\d+", text, re.MULTILINE))
    return Measured(version[1] if version else "", iterations, seconds, before, peak)


def _read(terminal: int) -> bytes:
    try:
        return os.read(terminal, 1 << 16)
    except OSError:  # the other end is closed
        return b""


def _memory_mb(pid: int, otherwise: tuple[float, float]) -> tuple[float, float]:
    """Memory of a process now and at most so far; of one that has ended nothing is known any more."""
    found = dict(re.findall(r"Vm(RSS|HWM):\s+(\d+) kB", Path(f"/proc/{pid}/status").read_text()))
    return (int(found["RSS"]) * 1024 / 1e6, int(found["HWM"]) * 1024 / 1e6) if found else otherwise
