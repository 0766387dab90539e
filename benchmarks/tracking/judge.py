"""The neutral judge: `python judge.py PROBLEM OUT PLACES…` writes a JSON list with an entry for each."""

import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


def judge(marks: NDArray[np.float64], visible: NDArray[np.bool_], places: NDArray[np.float64]) -> float | None:
    """How far (px) places (n, m, 2) are from marks, median over what is visible; a lost mark is infinitely far."""
    if places.shape != marks.shape:
        return None
    off = np.linalg.norm(places - marks, axis=2)
    found = float(np.median(np.where(np.isfinite(off), off, np.inf)[visible]))
    return found if np.isfinite(found) else None


if __name__ == "__main__":
    truth = np.load(sys.argv[1])
    answers = [np.load(name)["places"] for name in sys.argv[3:]]
    told = [{"difference": judge(truth["marks"], truth["visible"], places)} for places in answers]
    Path(sys.argv[2]).write_text(json.dumps(told))
