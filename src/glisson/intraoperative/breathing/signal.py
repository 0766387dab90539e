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

_ROUNDS = 4
_WAYS = 2
_TOLD = 0.05
"""A combination of ways that moves the seen markers by less than this share of what another does is left out."""


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
    """Places (n, k, 2), gaps filled with what two common ways of all markers, fitted to what is seen, say there."""
    n = len(tracks.times_s)
    seen = np.repeat(tracks.seen[:, often, None], 2, axis=2).reshape(n, -1)
    values = tracks.places[:, often].reshape(n, -1)
    if seen.all():
        return values.reshape(n, len(often), 2)
    scores = _first_scores(tracks.times_s, values, seen)
    patterns, which = np.unique(seen, axis=0, return_inverse=True)
    loads = np.zeros((1 + _WAYS, values.shape[1]))
    for _ in range(_ROUNDS):
        design = np.column_stack([np.ones(n), scores])
        for column in range(values.shape[1]):
            good = seen[:, column]
            loads[:, column] = np.linalg.lstsq(design[good], values[good, column], rcond=None)[0]
        told = np.zeros(n, dtype=bool)
        for number, pattern in enumerate(patterns):
            if pattern.sum() >= _WAYS:
                frames = np.flatnonzero(which.ravel() == number)
                off = values[np.ix_(frames, pattern)] - loads[0, pattern]
                scores[frames] = np.linalg.lstsq(loads[1:, pattern].T, off.T, rcond=_TOLD)[0].T
                told[frames] = True
        if not told.any():
            break
        scores = _bridged(tracks.times_s, scores, np.repeat(told[:, None], _WAYS, axis=1))
    guess = np.column_stack([np.ones(n), scores]) @ loads
    return np.where(seen, values, guess).reshape(n, len(often), 2)


def _first_scores(times: FloatArray, values: FloatArray, seen: NDArray[np.bool_]) -> FloatArray:
    """How far (n, ways) the markers that are seen most have gone along their common ways, gaps bridged in time."""
    share = seen.mean(axis=0)
    best = share >= np.median(share)
    bridged = _bridged(times, values[:, best], seen[:, best])
    u, sizes, _ = np.linalg.svd(bridged - bridged.mean(axis=0), full_matrices=False)
    scores = np.zeros((len(times), _WAYS))
    count = min(_WAYS, len(sizes))
    scores[:, :count] = u[:, :count] * sizes[:count]
    return scores


def _bridged(times: FloatArray, values: FloatArray, known: NDArray[np.bool_]) -> FloatArray:
    """Columns of values (n, c) with what is not known put in linearly in time."""
    bridged = np.array(values)
    for column in range(values.shape[1]):
        good = known[:, column]
        bridged[~good, column] = np.interp(times[~good], times[good], values[good, column])
    return bridged
