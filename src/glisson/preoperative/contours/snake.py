"""Snakes: a line drawn by hand that settles on the image (Kass, Witkin, Terzopoulos 1988, Int. J. Comput. Vis. 1:321).

The snake v(s) descends ∫ ½ (α |v'|² + β |v''|²) + E(v) ds, s being its length (dissertation, equations 2.34 and 2.35;
`snake_energy` has E). Tension and stiffness act implicitly and the image explicitly, so that steps may be long; points
are spread again where they have become uneven. The ends of an open snake stay where they were drawn.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.sparse import csr_array, diags_array, eye_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.parameters import parameter
from glisson.preoperative.contours.outline_spline import spread_evenly
from glisson.preoperative.contours.snake_energy import SnakeEnergy

_UNEVEN = 1.5
_FINE = 0.2


@dataclass(frozen=True)
class SnakeParameters:
    """How a snake moves and when it stops."""

    tension: float = parameter(0.02, "Tension α, mm²: draws the snake short.", 0.0, 1e3)
    stiffness: float = parameter(0.2, "Stiffness β, mm⁴: keeps it smooth.", 0.0, 1e5)
    step_mm2: float = parameter(1.0, "Length of a step in its own time, mm².", 1e-4, 1e3)
    farthest_mm: float = parameter(1.0, "Way of a point in a step at most, mm.", 1e-3, 100.0)
    spacing_mm: float = parameter(1.0, "Distance of points, mm.", 0.05, 50.0)
    iterations: int = parameter(500, "Steps at most.", 1, 100_000)
    tolerance_mm: float = parameter(0.005, "Mean move in a step at which it rests, mm.", 1e-6, 1.0)


@dataclass(frozen=True, eq=False)
class SnakeResult:
    """Where the snake came to rest: points (n, 2) in mm, steps, and mean distance from the start.

    `converged` is false when it still moved at the end.
    """

    points_mm: FloatArray
    iterations: int
    moved_mm: float
    converged: bool


def run_snake(
    energy: SnakeEnergy, points_mm: FloatArray, parameters: SnakeParameters, closed: bool = True
) -> SnakeResult:
    """Let a snake settle.

    Args:
        energy: of the slice.
        points_mm: as drawn (n, 2), along rows and columns in mm, in order; of a closed one the first is not repeated.
        parameters: how it moves.
        closed: whether its ends meet.

    Raises:
        BadInput: there are too few points.
    """
    drawn = np.asarray(points_mm, dtype=np.float64)
    if drawn.ndim != 2 or drawn.shape[1] != 2 or len(drawn) < (3 if closed else 2):
        raise BadInput(f"A {'closed' if closed else 'open'} contour needs more points (n, 2), not {drawn.shape}.")
    points = spread_evenly(drawn, parameters.spacing_mm, closed)
    iterations, rests = 0, False
    while iterations < parameters.iterations and not rests:
        iterations += 1
        moved = _step(energy, points, parameters, closed)
        rests = float(np.linalg.norm(moved - points, axis=1).mean()) < parameters.tolerance_mm
        even = _is_even(moved, parameters.spacing_mm, closed)
        points = moved if even else spread_evenly(moved, parameters.spacing_mm, closed)
    way, _ = cKDTree(spread_evenly(drawn, _FINE * parameters.spacing_mm, closed)).query(points)
    return SnakeResult(points, iterations, float(way.mean()), rests)


def _is_even(points: FloatArray, spacing_mm: float, closed: bool) -> bool:
    """Whether no distance is far from the wanted one; else the differences below would be wrong."""
    ends = np.vstack([points, points[:1]]) if closed else points
    apart = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    return bool(apart.max() < _UNEVEN * spacing_mm and apart.min() > spacing_mm / _UNEVEN)


def _step(energy: SnakeEnergy, points: FloatArray, parameters: SnakeParameters, closed: bool) -> FloatArray:
    push = parameters.step_mm2 * energy.force(points)
    push *= parameters.farthest_mm / np.maximum(np.linalg.norm(push, axis=1, keepdims=True), parameters.farthest_mm)
    first, second = _differences(len(points), closed)
    apart = float(np.linalg.norm(np.diff(points, axis=0), axis=1).mean())
    inner = parameters.tension / apart**2 * (first.T @ first) + parameters.stiffness / apart**4 * (second.T @ second)
    moving = np.ones(len(points))
    if not closed:
        moving[[0, -1]] = 0.0
    held = diags_array(moving)
    system = eye_array(len(points)) + parameters.step_mm2 * (held @ inner)
    moved: FloatArray = splu(system.tocsc()).solve(points + held @ push)
    return moved


@lru_cache(maxsize=8)
def _differences(count: int, closed: bool) -> tuple[csr_array, csr_array]:
    """First and second differences along a snake of so many points."""
    ones = np.ones(count)
    if closed:
        first = csr_array(diags_array([-ones, ones[1:], ones[:1]], offsets=[0, 1, 1 - count]))
        return first, first.T @ first
    first = csr_array(diags_array([-ones, ones[1:]], offsets=[0, 1]))[:-1]
    return first, first[:-1, :-1] @ first
