"""scikit-image: `python skimage_engine.py METHOD PICTURE OUT`."""

import sys

import numpy as np
import skimage
from adapter import Found, run
from numpy.typing import NDArray
from outlines import filled_outline, outline
from problem import ITERATIONS, Problem
from scipy import ndimage
from skimage.filters import gaussian
from skimage.segmentation import (
    active_contour,
    chan_vese,
    inverse_gaussian_gradient,
    morphological_chan_vese,
    morphological_geodesic_active_contour,
)


def global_chan_vese(problem: Problem) -> Found:
    """Chan and Vese's contour, which compares the means of all inside and all outside."""
    inside, outside = (ndimage.distance_transform_edt(mask) for mask in (problem.start, ~problem.start))
    found, _, energies = chan_vese(
        _scaled(problem),
        mu=0.1,
        max_num_iter=ITERATIONS,
        init_level_set=inside - outside,
        extended_output=True,
    )
    return Found(found, len(energies))


def morphological_global(problem: Problem) -> Found:
    """The same by morphological operators."""
    found = morphological_chan_vese(_scaled(problem), ITERATIONS, init_level_set=problem.start, smoothing=1)
    return Found(found > 0, ITERATIONS)


def morphological_geodesic(problem: Problem) -> Found:
    """A balloon that stops at edges, by morphological operators."""
    edges = inverse_gaussian_gradient(_scaled(problem), alpha=100.0, sigma=1.5)
    found = morphological_geodesic_active_contour(
        edges, ITERATIONS, init_level_set=problem.start, smoothing=1, threshold=0.55, balloon=1
    )
    return Found(found > 0, ITERATIONS)


def snake(problem: Problem) -> Found:
    """The Kass snake from the start's outline."""
    sigma = 3.0 / float(np.mean(problem.spacing_mm))
    points = active_contour(gaussian(_scaled(problem), sigma), outline(problem), alpha=0.0, beta=1.0, gamma=0.01)
    return Found(filled_outline(points, problem), None)  # it does not tell


def _scaled(problem: Problem) -> NDArray[np.float64]:
    low, high = float(problem.picture.min()), float(problem.picture.max())
    return (problem.picture.astype(np.float64) - low) / (high - low)


METHODS = {
    "chan_vese": global_chan_vese,
    "morphological_chan_vese": morphological_global,
    "morphological_geodesic_active_contour": morphological_geodesic,
    "active_contour": snake,
}

if __name__ == "__main__":
    run(skimage.__version__, METHODS[sys.argv[1]])
