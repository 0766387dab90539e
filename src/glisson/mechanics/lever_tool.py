"""The lever: a bar with rounded edges on a hinge."""

import numpy as np
from numba import njit

from glisson.core.arrays import FloatArray
from glisson.core.tools import Lever


class LeverTool:
    """A bar with rounded edges. Tool axes: arm, up and axis of the lever; origin: the bar's centre line start."""

    def __init__(self, lever: Lever) -> None:
        self.name = lever.name
        self.yields = False
        self.moves = True
        self.edge_radius_mm: float | None = lever.edge_radius_mm
        self.lever = lever
        self._half = np.array([lever.length_mm, lever.thickness_mm, lever.width_mm]) / 2.0
        self._centre = np.array([lever.length_mm / 2.0, -lever.thickness_mm / 2.0, 0.0])
        self._axes = np.stack([lever.arm, lever.up, np.cross(lever.arm, lever.up)], axis=1)

    def pose(self, angle: float) -> tuple[FloatArray, FloatArray]:
        """The bar turned about the hinge so that positive angles move the tip towards `up`."""
        turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
        return self._axes @ turn, self.lever.hinge_mm

    def distance(self, points: FloatArray) -> FloatArray:
        """Distance to the box with its edges rounded by `edge_radius_mm`."""
        radius = self.lever.edge_radius_mm
        result: FloatArray = _box_distance(points - self._centre, self._half - radius) - radius
        return result

    def derivatives(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Those of the distance to the box inside the rounding."""
        inner = self._half - self.lever.edge_radius_mm
        result: tuple[FloatArray, FloatArray] = _box_derivatives(points - self._centre, inner)
        return result


@njit(cache=True)
def _box_distance(points: FloatArray, half: FloatArray) -> FloatArray:
    """Distance (n,) of points to a box of half sizes `half`, negative inside."""
    distances = np.zeros(len(points))
    for n in range(len(points)):
        outside, deepest = 0.0, -np.inf
        for i in range(3):
            beyond = abs(points[n, i]) - half[i]
            deepest = max(deepest, beyond)
            if beyond > 0.0:
                outside += beyond * beyond
        distances[n] = np.sqrt(outside) if outside > 0.0 else deepest
    return distances


@njit(cache=True)
def _box_derivatives(points: FloatArray, half: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Gradient (n, 3) and Hessian (n, 3, 3) of `_box_distance`."""
    count = len(points)
    normals, hessians = np.zeros((count, 3)), np.zeros((count, 3, 3))
    for n in range(count):
        beyond = np.abs(points[n]) - half
        outside = 0.0
        for i in range(3):
            if beyond[i] > 0.0:
                outside += beyond[i] ** 2
        if outside == 0.0:  # deep inside: the nearest face counts
            axis = np.argmax(beyond)
            normals[n, axis] = np.sign(points[n, axis]) if points[n, axis] != 0.0 else 1.0
            continue
        reach = np.sqrt(outside)
        for i in range(3):
            if beyond[i] > 0.0:
                normals[n, i] = np.sign(points[n, i]) * beyond[i] / reach
        for i in range(3):
            for j in range(3):
                if beyond[i] > 0.0 and beyond[j] > 0.0:
                    unit = 1.0 if i == j else 0.0
                    hessians[n, i, j] = (unit - normals[n, i] * normals[n, j]) / reach
    return normals, hessians
