"""What every engine's script does around its work: `python ENGINE.py [METHOD] VIDEO OUT`.

Timed is all from opening the video file to the last frame's places, decoding among it, after imports and the same on
the first 20 frames, which compiles and loads what is needed.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from measuring import peak_mb, resident_mb, write_measured
from numpy.typing import NDArray

_WARM = 20

Places = NDArray[np.float64]


def run(version: str, follow: Callable[[Path, Places, int | None], Places | None]) -> None:
    """Warm up, follow the marks (m, 2) through the video of the command line (n, m, 2; NaN: lost), write both files."""
    problem, out = Path(sys.argv[-2]), Path(sys.argv[-1])
    video = problem.with_suffix(".avi")
    marks = np.load(problem)["marks"][0]
    follow(video, marks, _WARM)
    before = resident_mb()
    start = time.perf_counter()
    places = follow(video, marks, None)
    seconds = time.perf_counter() - start
    np.savez(out.with_suffix(".npz"), places=np.zeros((0, 0, 2)) if places is None else places)
    write_measured(out, version, None, seconds, before, peak_mb())
