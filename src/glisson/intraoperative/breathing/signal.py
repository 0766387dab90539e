"""One number for each frame that tells how far breathing has carried the tissue."""

from dataclasses import dataclass

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.core.tracks import Tracks

LEAST_SEEN = 0.5
"""Markers that are lost in more than this share of the frames tell nothing of breathing."""

_FILLINGS = 5


@dataclass(frozen=True, eq=False)
class Signal:
    """`values` (n,) along the main way of all markers together, in units of a mean marker's displacement.

    `filled` (n, k, 2) are places of the k markers that are seen often enough (`markers`, their numbers), with those that
    are missing put in by what the others do.
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


def _filled(tracks: Tracks, often: np.ndarray) -> FloatArray:
    """Places (n, k, 2): gaps are bridged in time, then put right by what two principal components say."""
    seen = np.repeat(tracks.seen[:, often, None], 2, axis=2).reshape(len(tracks.times_s), -1)
    values = tracks.places[:, often].reshape(len(tracks.times_s), -1).copy()
    for column in range(values.shape[1]):
        good = seen[:, column]
        values[~good, column] = np.interp(tracks.times_s[~good], tracks.times_s[good], values[good, column])
    if not seen.all():
        for _ in range(_FILLINGS):
            mean = values.mean(axis=0)
            u, sizes, v = np.linalg.svd(values - mean, full_matrices=False)
            values = np.where(seen, values, (u[:, :2] * sizes[:2]) @ v[:2] + mean)
    return values.reshape(len(values), len(often), 2)
