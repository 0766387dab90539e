"""Glisson's contours: `python glisson_engine.py uniform|separation|snake PICTURE OUT`."""

import sys

import numpy as np
from adapter import Found, run
from outlines import filled_outline, outline
from problem import BALL_MM, BALL_PIXELS, ITERATIONS, Problem

import glisson
from glisson.preoperative.contours.localized_contour import LocalizedContourParameters, evolve
from glisson.preoperative.contours.snake import SnakeParameters, run_snake
from glisson.preoperative.contours.snake_energy import SnakeEnergy, SnakeWeights


def localized(problem: Problem, energy: str) -> Found:
    """The localized active contour with its defaults, but for the ball and where it may go."""
    in_slice = problem.truth.ndim == 2
    radius = BALL_PIXELS * float(np.mean(problem.spacing_mm)) if in_slice else BALL_MM
    parameters = LocalizedContourParameters(energy=energy, radius_mm=radius, iterations=ITERATIONS)
    result = evolve(problem.picture, problem.start, problem.spacing_mm, parameters)
    return Found(result.mask, result.iterations)


def snake(problem: Problem) -> Found:
    """The Kass snake from the start's outline."""
    energy = SnakeEnergy(problem.picture, problem.spacing_mm, SnakeWeights(sigma_mm=3.0))
    result = run_snake(energy, outline(problem) * problem.spacing_mm, SnakeParameters(tension=0.0))
    return Found(filled_outline(result.points_mm / problem.spacing_mm, problem), result.iterations)


if __name__ == "__main__":
    method = sys.argv[1]
    run(glisson.__version__, snake if method == "snake" else lambda problem: localized(problem, method))
