"""What every engine's script does around its work: `python ENGINE.py [METHOD] PICTURE OUT`.

Timed is all from picture and start to a mask, after imports, reading, and the same on a tiny disc, which compiles and
loads what is needed.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from measuring import peak_mb, resident_mb, write_measured
from numpy.typing import NDArray
from problem import Problem, load_problem
from scipy import ndimage


@dataclass(frozen=True, eq=False)
class Found:
    """A mask, and the iterations that it took, where they are told."""

    mask: NDArray[np.bool_]
    iterations: int | None


def run(version: str, segment: Callable[[Problem], Found]) -> None:
    """Warm up, segment the picture of the command line, write both files."""
    problem, out = load_problem(Path(sys.argv[-2])), Path(sys.argv[-1])
    segment(tiny_problem(problem.truth.ndim))
    before = resident_mb()
    start = time.perf_counter()
    found = segment(problem)
    seconds = time.perf_counter() - start
    np.savez_compressed(out.with_suffix(".npz"), mask=found.mask)
    write_measured(out, version, found.iterations, seconds, before, peak_mb())


def tiny_problem(dimensions: int) -> Problem:
    """A bright disc or ball of 24 mm in noise, the start 6 mm smaller."""
    shape, spacing = (40,) * dimensions, np.full(dimensions, 1.5)
    away = np.sqrt(sum((1.5 * (axis - 19.5)) ** 2 for axis in np.indices(shape)))
    noise = np.random.default_rng(0).normal(0.0, 6.0, shape)
    picture = ndimage.gaussian_filter(np.where(away < 24.0, 110.0, 26.0) + noise, 0.7)
    return Problem(picture.astype(np.float32), spacing, away < 18.0, away < 24.0)
