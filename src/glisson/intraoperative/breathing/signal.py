"""One number for each frame that tells how far breathing has carried the tissue."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.core.tracks import Tracks

LEAST_SEEN = 0.5
"""Markers that are lost in more than this share of the frames tell nothing of breathing."""

_FILLINGS = 10
_WAYS = 2


@dataclass(frozen=True, eq=False)
class Signal:
    """`values` (n,) along the main way of all markers together, in units of a mean marker's displacement.

    `filled` (n, k, 2) are places of the k markers that are seen often enough (`markers`, their numbers), with those
    that are missing put in by what the others do.
    """

    values: FloatArray
    filled: FloatArray
    markers: tuple[int, ...]


def breathing_signal(tracks: Tracks) -> Signal:
    """The first principal component of all markers' places.

    Raises:
        StageFailed: no marker is seen in half of the frames.
    """
    often = np.flatnonzero(tracks.seen.mean(axis=0) >= LEAST_SEEN)
    if len(often) == 0:
        raise StageFailed("No marker is seen in half of the frames, so breathing cannot be told.", Status.UNOBSERVABLE)
    filled = _filled(tracks, often)
    centred = filled.reshape(len(filled), -1) - filled.reshape(len(filled), -1).mean(axis=0)
    u, sizes, _ = np.linalg.svd(centred, full_matrices=False)
    return Signal(u[:, 0] * sizes[0] / np.sqrt(len(often)), filled, tuple(int(n) for n in often))


def _filled(tracks: Tracks, often: NDArray[np.int64]) -> FloatArray:
    """Places (n, k, 2): gaps are bridged in time, then filled with what the two main ways of all say of those seen."""
    n = len(tracks.times_s)
    seen = np.repeat(tracks.seen[:, often, None], 2, axis=2).reshape(n, -1)
    values = tracks.places[:, often].reshape(n, -1).copy()
    for column in range(values.shape[1]):
        good = seen[:, column]
        values[~good, column] = np.interp(tracks.times_s[~good], tracks.times_s[good], values[good, column])
    if seen.all():
        return values.reshape(n, len(often), 2)
    patterns, which = np.unique(seen, axis=0, return_inverse=True)
    for _ in range(_FILLINGS):
        mean = values.mean(axis=0)
        _, sizes, ways = np.linalg.svd(values - mean, full_matrices=False)
        ways = ways[:_WAYS]
        # How far each way is likely to be gone, against noise: a way that only a bridged marker takes stays short.
        noise = (sizes[_WAYS:] ** 2).sum() / max(values.shape[1] - _WAYS, 1)
        prior = np.diag(noise / np.maximum(sizes[: len(ways)] ** 2, 1e-12))
        for number, pattern in enumerate(patterns):
            if pattern.all() or not pattern.any():
                continue
            frames = np.flatnonzero(which.ravel() == number)
            known = ways[:, pattern]
            scores = np.linalg.solve(known @ known.T + prior, known @ (values[frames][:, pattern] - mean[pattern]).T)
            values[np.ix_(frames, ~pattern)] = mean[~pattern] + scores.T @ ways[:, ~pattern]
    return values.reshape(n, len(often), 2)
