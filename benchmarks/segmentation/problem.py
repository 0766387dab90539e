"""The problem: the liver in one slice (pixels) or a whole scan (voxels) of a phantom, from a mask well inside it."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

MEMBER = 41
"""Member of the phantom family; every engine's settings were tried out on member 40."""

START_MM = 6.0
"""The start is the true liver without its outermost millimetres."""

BALL_PIXELS, ITERATIONS = 15, 150
"""Of the localized contour in a slice; iterations are also what the others are allowed."""

BALL_MM = 10.0
"""Of the localized contour in a whole scan."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A picture (HU, float32) in two or three dimensions with its spacing (mm), start, and the true liver."""

    picture: NDArray[np.float32]
    spacing_mm: NDArray[np.float64]
    start: NDArray[np.bool_]
    truth: NDArray[np.bool_]

    @property
    def contrast(self) -> float:
        """Spread of grey values in the start, robust (HU)."""
        inside = self.picture[self.start]
        return float(1.4826 * np.median(np.abs(inside - np.median(inside))))


def load_problem(path: Path) -> Problem:
    """A problem as `meshes.py` wrote it."""
    with np.load(path) as stored:
        return Problem(stored["picture"], stored["spacing_mm"], stored["start"], stored["truth"])
