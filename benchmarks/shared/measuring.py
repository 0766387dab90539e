"""What an engine's script tells of its work: OUT.npz gets its answer, OUT.json what was measured."""

import json
import os
import resource
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Solution:
    """Displacement (n, 3) in mm and the number of Newton iterations (linear solves) of all load steps."""

    displacement: NDArray[np.float64]
    iterations: int


class Failed(Exception):
    """The engine gave no solution; the text says why."""


def write(out: Path, version: str, solution: Solution, seconds: float, before_mb: float, peak: float) -> None:
    """Write OUT.npz and OUT.json."""
    np.savez(out.with_suffix(".npz"), displacement=solution.displacement)
    write_measured(out, version, solution.iterations, seconds, before_mb, peak)


def write_measured(
    out: Path, version: str, iterations: int | None, seconds: float, before_mb: float, peak: float
) -> None:
    """Write OUT.json; `iterations` is None where an engine doesn't tell."""
    values = {
        "version": version,
        "seconds": seconds,
        "iterations": iterations,
        "memory_mb": peak,
        "memory_before_mb": before_mb,
    }
    out.with_suffix(".json").write_text(json.dumps(values))


def resident_mb() -> float:
    """Memory of this process now in MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def peak_mb() -> float:
    """The most memory that this process had, in MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e6
