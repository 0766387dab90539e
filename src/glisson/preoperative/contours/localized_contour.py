"""Localized active contours (Lankton and Tannenbaum 2008, IEEE Trans. Image Process. 17:2029) in 2-D and 3-D.

φ is a signed distance in mm, negative inside. Around each point y of the contour the image is summed up
in the ball B(y, ·) of a given radius: u_y and v_y are the means inside and outside, A_u and A_v the
numbers of voxels. With H = ½(1 − φ/ε − sin(πφ/ε)/π), 1 inside, and δ = −dH/dφ, the flows are

    uniform:     ∂φ/∂t =  δ(φ(x)) Σ_y B(x, y) δ(φ(y)) [(I(x) − u_y)² − (I(x) − v_y)²]
    separation:  ∂φ/∂t = −δ(φ(x)) Σ_y B(x, y) δ(φ(y)) (u_y − v_y) [(I(x) − u_y)/A_u + (I(x) − v_y)/A_v]

plus λ δ(φ) κ. They descend Σ_y δ(φ(y)) E_y with the local energies E_y = Σ_x B [H (I − u_y)² + (1 − H)(I − v_y)²]
and E_y = −½(u_y − v_y)²; the variation of the outer δ(φ(y)) is dropped, as in the paper. The paper prints the
sums with x and y exchanged (I(y) against u_x): then a point moves as its neighbours want, and ripples shorter
than the ball grow. The force is brought to (grey value)² by
dividing by Σ B δ and, for separation, multiplying by the mean of the areas, and then saturates: F / (|F| + c²)
with a contrast c. Dividing by the largest |F| instead would let one strong edge stall all the weak ones.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.parameters import parameter
from glisson.preoperative.contours.signed_distance import reinitialised, signed_distance_of_mask

_HALF_WIDTH = 1.5
"""ε in voxels: the width of the smoothed Heaviside to either side."""

_STEP = 0.5
"""Largest move in one iteration, in voxels (CFL)."""

_WATCHED = 10
"""Iterations over which it is judged whether the contour still moves."""


@dataclass(frozen=True)
class LocalizedContourParameters:
    """What drives a localized contour and when it stops."""

    energy: str = parameter(
        "uniform", "Energy: uniform modelling or mean separation.", choices=("uniform", "separation")
    )
    radius_mm: float = parameter(10.0, "Radius of the ball in which the image is looked at, mm.", 0.5, 200.0)
    curvature: float = parameter(0.3, "Weight of the curvature, in voxels.", 0.0, 10.0)
    contrast: float = parameter(15.0, "Grey-value contrast at which the force is half saturated.", 1e-3, 1e4)
    iterations: int = parameter(150, "Iterations at most.", 1, 100_000)
    tolerance: float = parameter(0.02, "Mean move over ten iterations, in voxels, below which it stops.", 1e-6, 1.0)


@dataclass(frozen=True, eq=False)
class ContourResult:
    """Where the contour came to rest.

    `phi` is the signed distance in mm on the image's grid, negative inside and exact near the contour only;
    `moved_mm` the mean distance from the start along the final contour; `converged` is false when it still
    moved at the end.
    """

    phi: FloatArray
    iterations: int
    moved_mm: float
    converged: bool

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Voxels whose centre lies inside."""
        inside: NDArray[np.bool_] = self.phi < 0.0
        return inside


def evolve(
    image: NDArray[np.floating],
    start: NDArray[np.bool_],
    spacing_mm: FloatArray,
    parameters: LocalizedContourParameters,
    freedom_mm: float | None = None,
) -> ContourResult:
    """Let a contour flow from the border of a mask until it rests.

    Args:
        image: grey values, 2-D or 3-D.
        start: the mask that it starts from, same shape.
        spacing_mm: pixel or voxel spacing, one number for each axis.
        parameters: forces and stop.
        freedom_mm: how far the contour may get from its start, to either side; None: as far as it likes.

    Raises:
        BadInput: shapes differ, or the start is empty or everything.
    """
    if image.shape != start.shape or image.ndim not in (2, 3) or len(spacing_mm) != image.ndim:
        raise BadInput(f"Image {image.shape}, starting mask {start.shape} and {len(spacing_mm)} spacings do not fit.")
    if not start.any() or start.all():
        raise BadInput("A contour needs a starting mask that is neither empty nor the whole image.")
    spacing = np.ones(3)
    spacing[3 - image.ndim :] = spacing_mm
    box = _reachable_box(start, np.asarray(spacing_mm, dtype=np.float64), parameters)
    shape = start[box].shape if image.ndim == 3 else (1, *start[box].shape)
    phi = signed_distance_of_mask(start[box], spacing_mm).reshape(shape)
    flow = _Flow(image[box].reshape(shape).astype(np.float32), spacing, parameters, image.ndim)
    final, iterations, converged = flow.run(phi, freedom_mm)
    contour = np.abs(final) <= flow.epsilon
    moved = float(np.abs(final - phi)[contour].mean()) if contour.any() else 0.0
    whole = np.full(start.shape, flow.band)
    whole[box] = final.reshape(start[box].shape)
    return ContourResult(whole, iterations, moved, converged)


def _reachable_box(
    start: NDArray[np.bool_], spacing: FloatArray, parameters: LocalizedContourParameters
) -> tuple[slice, ...]:
    """Where the contour can get to in its iterations, and the balls around it."""
    reach = parameters.radius_mm + _STEP * parameters.iterations * float(spacing.min()) + 4.0 * float(spacing.max())
    box = []
    for axis, count in enumerate(start.shape):
        occupied = np.flatnonzero(start.any(axis=tuple(a for a in range(start.ndim) if a != axis)))
        margin = int(reach / spacing[axis]) + 1
        box.append(slice(max(int(occupied[0]) - margin, 0), min(int(occupied[-1]) + margin + 1, count)))
    return tuple(box)


class _Flow:
    """The image, its balls and the forces; arrays are (layer, row, column), a 2-D image has one layer."""

    def __init__(
        self, image: NDArray[np.float32], spacing: FloatArray, parameters: LocalizedContourParameters, dimensions: int
    ) -> None:
        self._image, self._spacing, self._parameters = image, spacing, parameters
        used = spacing[3 - dimensions :]
        self._voxel = float(used.min())
        self.epsilon = _HALF_WIDTH * float(used.mean())
        self.band = 3.0 * self.epsilon
        self._ball = ball_rows(parameters.radius_mm, spacing, dimensions)

    def run(self, start: FloatArray, freedom_mm: float | None) -> tuple[FloatArray, int, bool]:
        """The contour at rest, the iterations made and whether it rests."""
        phi = reinitialised(start, self._spacing, self.band)
        watched = phi
        for iteration in range(1, self._parameters.iterations + 1):
            phi = self._stepped(phi)
            if freedom_mm is not None:
                phi = np.clip(phi, start - freedom_mm, start + freedom_mm)
            if not (phi < 0.0).any():
                return phi, iteration, True
            if iteration % 2 == 0:
                phi = reinitialised(phi, self._spacing, self.band)
            if iteration % _WATCHED == 0:
                band = np.abs(phi) <= self.epsilon
                if float(np.abs(phi - watched)[band].mean()) < self._parameters.tolerance * self._voxel:
                    return phi, iteration, True
                watched = phi
        return phi, self._parameters.iterations, False

    def _stepped(self, phi: FloatArray) -> FloatArray:
        points = np.argwhere(np.abs(phi) < self.epsilon)
        inside, delta = smoothed_heaviside(phi, self.epsilon)
        separation = self._parameters.energy == "separation"
        raw, weights, areas = local_forces(self._image, inside, delta, points, self._ball, separation)
        force = raw / np.maximum(weights, 1e-12) * (0.5 * areas if separation else 1.0)
        saturated = force / (np.abs(force) + self._parameters.contrast**2)
        bending = self._parameters.curvature * self._voxel * curvatures(phi, points, self._spacing)
        speed = np.clip(saturated + bending, -1.0, 1.0)
        at = tuple(points.T)
        result = phi.copy()
        # δ ε is 1 on the contour: there the speed is in steps of `_STEP` voxels.
        result[at] += _STEP * self._voxel * delta[at] * self.epsilon * speed
        return result


@njit(cache=True)
def smoothed_heaviside(phi: FloatArray, epsilon: float) -> tuple[FloatArray, FloatArray]:
    """H (1 inside, where φ < 0) and δ = −dH/dφ of a level set (i, j, k); exactly 1, 0 and 0 beyond |φ| = ε."""
    inside, delta = np.zeros(phi.shape), np.zeros(phi.shape)
    flat, flat_inside, flat_delta = phi.ravel(), inside.ravel(), delta.ravel()
    for n in range(flat.size):
        scaled = flat[n] / epsilon
        if scaled <= -1.0:
            flat_inside[n] = 1.0
        elif scaled < 1.0:
            flat_inside[n] = 0.5 * (1.0 - scaled - np.sin(np.pi * scaled) / np.pi)
            flat_delta[n] = (1.0 + np.cos(np.pi * scaled)) / (2.0 * epsilon)
    return inside, delta


def ball_rows(radius_mm: float, spacing: FloatArray, dimensions: int) -> IntArray:
    """The ball as rows (m, 3): offsets of layer and row, and how many columns it reaches to either side."""
    layers = int(radius_mm / spacing[0]) if dimensions == 3 else 0
    rows = int(radius_mm / spacing[1])
    ball = []
    for layer in range(-layers, layers + 1):
        for row in range(-rows, rows + 1):
            left = radius_mm**2 - (layer * spacing[0]) ** 2 - (row * spacing[1]) ** 2
            if left >= 0.0:
                ball.append((layer, row, int(np.sqrt(left) / spacing[2])))
    return np.array(ball, dtype=np.int64)


@njit(cache=True)
def local_forces(
    image: NDArray[np.float32],
    inside: FloatArray,
    delta: FloatArray,
    points: IntArray,
    ball: IntArray,
    separation: bool,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The sums over y of the flows in the module's head, without the factor δ(φ(x)).

    Both are linear in I(x), so the terms of y are kept as running sums along the rows, and the sum over
    a ball costs a few numbers for each of its rows.

    Args:
        image: grey values (layer, row, column).
        inside: H(φ) on the same grid.
        delta: δ(φ) on the same grid.
        points: all voxels (n, 3) where δ is positive, in the array's order; the force is given there.
        ball: the ball's rows, from `ball_rows`.
        separation: mean separation instead of uniform modelling.

    Returns:
        The sum (n,), the weight Σ B δ (n,), and the mean of A_u + A_v (n,). Balls that see one side only do
        not count.
    """
    layers, rows, _ = image.shape
    terms = _running_terms(image, inside, delta, points, ball, separation)
    starts = np.zeros(layers * rows + 1, dtype=np.int64)
    for p in range(len(points)):
        starts[points[p, 0] * rows + points[p, 1] + 1] += 1
    starts = np.cumsum(starts)
    count = len(points)
    forces, weights, areas = np.zeros(count), np.zeros(count), np.zeros(count)
    for p in range(count):
        slope, constant, weight, area = 0.0, 0.0, 0.0, 0.0
        for b in range(len(ball)):
            layer, row, width = points[p, 0] + ball[b, 0], points[p, 1] + ball[b, 1], ball[b, 2]
            if 0 <= layer < layers and 0 <= row < rows:
                begin, end = starts[layer * rows + row], starts[layer * rows + row + 1]
                low = _first_from(points, begin, end, points[p, 2] - width)
                high = _first_from(points, low, end, points[p, 2] + width + 1)
                slope += terms[high, 0] - terms[low, 0]
                constant += terms[high, 1] - terms[low, 1]
                weight += terms[high, 2] - terms[low, 2]
                area += terms[high, 3] - terms[low, 3]
        forces[p] = slope * image[points[p, 0], points[p, 1], points[p, 2]] + constant
        weights[p], areas[p] = weight, area / max(weight, 1e-12)
    return forces, weights, areas


@njit(cache=True)
def _first_from(points: IntArray, begin: int, end: int, column: int) -> int:
    """First of the points begin … end − 1 of one row whose column is at least `column`."""
    while begin < end:
        middle = (begin + end) // 2
        if points[middle, 2] < column:
            begin = middle + 1
        else:
            end = middle
    return begin


@njit(cache=True)
def _running_terms(
    image: NDArray[np.float32],
    inside: FloatArray,
    delta: FloatArray,
    points: IntArray,
    ball: IntArray,
    separation: bool,
) -> FloatArray:
    """Running sums (n + 1, 4) over the points y of δ times: factor of I(x), constant, 1, and A_u + A_v."""
    layers, rows, columns = image.shape
    sums = np.zeros((layers, rows, columns + 1, 3))
    for r in range(layers * rows):
        layer, row = r // rows, r % rows
        for c in range(columns):
            h, value = inside[layer, row, c], float(image[layer, row, c])
            sums[layer, row, c + 1, 0] = sums[layer, row, c, 0] + h
            sums[layer, row, c + 1, 1] = sums[layer, row, c, 1] + h * value
            sums[layer, row, c + 1, 2] = sums[layer, row, c, 2] + value
    terms = np.zeros((len(points) + 1, 4))
    for p in range(len(points)):
        area, area_in, total, total_in = 0.0, 0.0, 0.0, 0.0
        for b in range(len(ball)):
            layer, row, width = points[p, 0] + ball[b, 0], points[p, 1] + ball[b, 1], ball[b, 2]
            if 0 <= layer < layers and 0 <= row < rows:
                low, high = max(points[p, 2] - width, 0), min(points[p, 2] + width + 1, columns)
                area += high - low
                area_in += sums[layer, row, high, 0] - sums[layer, row, low, 0]
                total_in += sums[layer, row, high, 1] - sums[layer, row, low, 1]
                total += sums[layer, row, high, 2] - sums[layer, row, low, 2]
        area_out = area - area_in
        if area_in > 1e-6 and area_out > 1e-6:
            u, v = total_in / area_in, (total - total_in) / area_out
            d = delta[points[p, 0], points[p, 1], points[p, 2]]
            if separation:
                terms[p + 1, 0] = -d * (u - v) * (1.0 / area_in + 1.0 / area_out)
                terms[p + 1, 1] = d * (u - v) * (u / area_in + v / area_out)
            else:
                terms[p + 1, 0] = 2.0 * d * (v - u)
                terms[p + 1, 1] = d * (u * u - v * v)
            terms[p + 1, 2], terms[p + 1, 3] = d, d * area
    for p in range(len(points)):
        terms[p + 1] += terms[p]
    return terms


@njit(cache=True)
def curvatures(phi: FloatArray, points: IntArray, spacing: FloatArray) -> FloatArray:
    """κ = div(∇φ/|∇φ|) in 1/mm at voxels (n, 3) by central differences; 2/R on a sphere, 1/R on a circle."""
    result = np.zeros(len(points))
    first, second = np.zeros(3), np.zeros((3, 3))
    step = np.zeros(3, dtype=np.int64)
    low, high, cross = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    for p in range(len(points)):
        for axis in range(3):
            step[:] = 0
            step[axis] = 1
            for n in range(3):
                low[n] = max(points[p, n] - step[n], 0)
                high[n] = min(points[p, n] + step[n], phi.shape[n] - 1)
            below, here, above = (
                phi[low[0], low[1], low[2]],
                phi[points[p, 0], points[p, 1], points[p, 2]],
                phi[high[0], high[1], high[2]],
            )
            first[axis] = (above - below) / (2.0 * spacing[axis])
            second[axis, axis] = (above - 2.0 * here + below) / spacing[axis] ** 2
            for other in range(axis):
                mixed = 0.0
                for sign_a in (-1, 1):
                    for sign_b in (-1, 1):
                        for n in range(3):
                            move = sign_a * (n == axis) + sign_b * (n == other)
                            cross[n] = min(max(points[p, n] + move, 0), phi.shape[n] - 1)
                        mixed += sign_a * sign_b * phi[cross[0], cross[1], cross[2]]
                second[axis, other] = mixed / (4.0 * spacing[axis] * spacing[other])
                second[other, axis] = second[axis, other]
        squared = first[0] ** 2 + first[1] ** 2 + first[2] ** 2
        bent = 0.0
        for a in range(3):
            for b in range(3):
                bent += first[a] * second[a, b] * first[b]
        trace = second[0, 0] + second[1, 1] + second[2, 2]
        # ε guards ridges of φ, where the gradient vanishes.
        result[p] = (trace * squared - bent) / max(squared, 1e-6) ** 1.5
    return result
