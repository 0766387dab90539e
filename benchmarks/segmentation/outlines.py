"""Outlines of masks in a slice, and masks of outlines, for snakes."""

import numpy as np
from numpy.typing import NDArray
from problem import Problem
from skimage.draw import polygon2mask
from skimage.measure import find_contours


def outline(problem: Problem) -> NDArray[np.float64]:
    """The longest outline (n, 2) of the start, in pixels, its first point not repeated."""
    longest = max(find_contours(problem.start.astype(float), 0.5), key=len)
    return longest[:-1]


def filled_outline(points: NDArray[np.float64], problem: Problem) -> NDArray[np.bool_]:
    """The mask inside points (n, 2) in pixels."""
    inside: NDArray[np.bool_] = polygon2mask(problem.truth.shape, points)
    return inside
