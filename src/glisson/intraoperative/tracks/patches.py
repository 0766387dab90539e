"""The surroundings of each marker in the first frame, laid onto later frames."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.geometry.compiled import compiled

RADIUS_PX = 14
"""A patch has 2 · 14 + 1 pixels a side."""

_ITERATIONS = 8
_STILL_PX = 0.01
_WARP_PX = 1.0
"""Standard deviation, known before, of how far a corner of the patch is carried by what is no translation."""

_NOISE = 4.0
"""Grey levels; weighs that knowledge against the picture."""

_OUTLIER = 3.0
"""Grey values further off than so many robust standard deviations are of something else: glare, what comes between."""

_CLEAN = 0.02
"""Share of something else in a patch that does no harm."""


@dataclass(frozen=True, eq=False)
class Aligned:
    """Patches as they lie in a frame, m of them.

    Args:
        places: (m, 2) of their middles, px.
        warps: (m, 2, 2), px by which the patch's edge is carried by what is no translation.
        covariance: (m, 2, 2) of the places, px².
        likeness: (m,) normalised correlation with the first frame, 1 being the same but for gain and offset.
        spoilt: (m,) share of the patch that is something else.
    """

    places: FloatArray
    warps: FloatArray
    covariance: FloatArray
    likeness: FloatArray
    spoilt: FloatArray


class Patches:
    """Lays the patches of a first frame onto others.

    Each patch may shift, stretch, turn and shear a little and become brighter or darker. The least squares are
    solved by Gauss and Newton's iteration with the first frame's derivatives (Hager and Belhumeur 1998), all patches
    together. Since it is always the first frame that is laid on, no error adds up.
    """

    def __init__(self, grey: NDArray[np.uint8], places: FloatArray) -> None:
        side = np.arange(-RADIUS_PX, RADIUS_PX + 1, dtype=np.float64)
        y, x = (axis.ravel() for axis in np.meshgrid(side, side, indexing="ij"))
        self._weight = np.exp(-0.5 * (x * x + y * y) / (0.6 * RADIUS_PX) ** 2)
        self._weight /= self._weight.mean()
        no_warp = np.zeros((len(places), 2, 2))
        self._first = self._sampled(grey, places, no_warp)
        step = np.array([0.5, 0.0])
        across = self._sampled(grey, places + step, no_warp) - self._sampled(grey, places - step, no_warp)
        down = self._sampled(grey, places + step[::-1], no_warp) - self._sampled(grey, places - step[::-1], no_warp)
        one = np.ones_like(across)
        x, y = x / RADIUS_PX, y / RADIUS_PX
        columns = [across, down, across * x, across * y, down * x, down * y, self._first, one]
        self._jacobian = np.stack(columns, axis=2)
        self._prior = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0]) * (_NOISE / _WARP_PX) ** 2
        weighed = self._jacobian * self._weight[None, :, None]
        normal = np.swapaxes(weighed, 1, 2) @ self._jacobian + np.diag(self._prior) + 1e-6 * np.eye(8)
        self._inverse = np.linalg.inv(normal)
        self._project = self._inverse @ np.swapaxes(weighed, 1, 2)
        # What white noise of variance one does to the answer.
        self._spread = (self._project @ np.swapaxes(self._project, 1, 2))[:, :2, :2]

    def aligned(
        self, grey: NDArray[np.uint8], which: NDArray[np.int64], places: FloatArray, warps: FloatArray
    ) -> Aligned:
        """The patches `which` (k,), laid onto a frame from guesses (k, 2) and (k, 2, 2)."""
        places, warps = places.copy(), warps.copy()
        first = self._first[which]
        gain, offset = np.ones(len(which)), np.zeros(len(which))
        moving = np.arange(len(which))
        for _ in range(_ITERATIONS):
            now = self._sampled(grey, places[moving], warps[moving])
            off, outside = self._residual(now, first[moving], gain[moving], offset[moving])
            step = self._step(which[moving], off, outside, warps[moving])
            places[moving] -= step[:, :2]
            warps[moving] -= step[:, 2:6].reshape(-1, 2, 2)
            offset[moving] += gain[moving] * step[:, 7]
            gain[moving] *= np.clip(1.0 + step[:, 6], 0.5, 2.0)
            moving = moving[np.abs(step[:, :2]).max(axis=1) > _STILL_PX]
            if len(moving) == 0:
                break
        now = self._sampled(grey, places, warps)
        off, outside = self._residual(now, first, gain, offset)
        spoilt = (self._weight * outside).mean(axis=1)
        variance = (self._weight * np.where(outside, 0.0, off) ** 2).mean(axis=1) / np.maximum(1.0 - spoilt, 0.1) ** 2
        return Aligned(
            places, warps, variance[:, None, None] * self._spread[which], self._likeness(now, first), spoilt
        )  # fmt: skip

    def templates(self, which: NDArray[np.int64]) -> NDArray[np.float32]:
        """The patches `which` (k, side, side) as they are in the first frame."""
        side = 2 * RADIUS_PX + 1
        return self._first[which].reshape(-1, side, side).astype(np.float32)

    def _sampled(self, grey: NDArray[np.uint8], places: FloatArray, warps: FloatArray) -> FloatArray:
        """Grey values (k, side²) of a frame where the patches lie."""
        values = np.zeros((len(places), (2 * RADIUS_PX + 1) ** 2))
        _sample(grey, places, warps, values)
        return values

    def _step(
        self, which: NDArray[np.int64], off: FloatArray, outside: NDArray[np.bool_], warps: FloatArray
    ) -> FloatArray:
        """Steps (k, 8) of place, warp, gain and offset: with all of a patch where it is clean, else with what is."""
        pull = np.zeros((len(which), 8))
        pull[:, 2:6] = self._prior[2:6] * warps.reshape(-1, 4)
        step = np.matmul(self._project[which], off[:, :, None]) + np.matmul(self._inverse[which], pull[:, :, None])
        for k in np.flatnonzero((self._weight * outside).mean(axis=1) > _CLEAN):
            clean = ~outside[k]
            jacobian = self._jacobian[which[k]][clean]
            weighed = (jacobian * self._weight[clean, None]).T
            normal = weighed @ jacobian + np.diag(self._prior) + 1e-6 * np.eye(8)
            step[k, :, 0] = np.linalg.solve(normal, weighed @ off[k, clean] + pull[k])
        return np.asarray(step[:, :, 0])

    def _residual(
        self, now: FloatArray, first: FloatArray, gain: FloatArray, offset: FloatArray
    ) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Grey values off (k, side²), and which of them are of something else."""
        off = (now - offset[:, None]) / gain[:, None] - first
        size = np.abs(off)
        # A quarter of the pixels tells the spread as well.
        limit = _OUTLIER * np.maximum(1.4826 * np.median(size[:, ::4], axis=1, keepdims=True), _NOISE)
        return off, size > limit

    def _likeness(self, now: FloatArray, first: FloatArray) -> FloatArray:
        now = now - np.average(now, axis=1, weights=self._weight)[:, None]
        first = first - np.average(first, axis=1, weights=self._weight)[:, None]
        product = (self._weight * now * first).sum(axis=1)
        size = np.sqrt((self._weight * now**2).sum(axis=1) * (self._weight * first**2).sum(axis=1))
        return np.asarray(product / np.maximum(size, 1e-9))


@compiled
def _sample(grey: NDArray[np.uint8], places: FloatArray, warps: FloatArray, values: FloatArray) -> None:
    """Bilinear grey values (k, side²) of patches; beyond the border they are those of the border."""
    rows, columns = grey.shape
    for k in range(len(places)):
        n = 0
        for y in range(-RADIUS_PX, RADIUS_PX + 1):
            for x in range(-RADIUS_PX, RADIUS_PX + 1):
                u = places[k, 0] + x + (warps[k, 0, 0] * x + warps[k, 0, 1] * y) / RADIUS_PX
                v = places[k, 1] + y + (warps[k, 1, 0] * x + warps[k, 1, 1] * y) / RADIUS_PX
                u = min(max(u, 0.0), columns - 1.000001)
                v = min(max(v, 0.0), rows - 1.000001)
                i, j = int(v), int(u)
                a, b = v - i, u - j
                top = (1.0 - b) * grey[i, j] + b * grey[i, j + 1]
                low = (1.0 - b) * grey[i + 1, j] + b * grey[i + 1, j + 1]
                values[k, n] = (1.0 - a) * top + a * low
                n += 1
