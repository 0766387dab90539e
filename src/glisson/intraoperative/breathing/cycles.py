"""Breaths told apart: when exhalation and inhalation are full, and the phase of each frame."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d
from scipy.signal import find_peaks

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.tracks import Tracks
from glisson.intraoperative.breathing.signal import Signal, breathing_signal
from glisson.intraoperative.breathing.waveform import Knots, fitted_knots

_REPEATS = 0.25
"""Least correlation of the signal with itself a breath later."""

_SMOOTH = 0.04
_APART, _PROMINENT = 0.45, 0.35
"""Two inhalations are at least this share of a period apart, and stand out by this share of the signal's range."""

_NEARLY = 0.15
"""An exhalation at an end of the recording is full within this share of a breath's depth."""

_ENOUGH = 80
"""Values per breath with which its shape is fitted."""

_DWELL = 0.03
"""The share of the range by which the middle of all values must be nearer to one end, for that to be exhalation."""


@dataclass(frozen=True, eq=False)
class Cycles:
    """Breaths of a recording. A breath begins, at phase 0, with full exhalation, when the lungs begin to fill.

    Args:
        exhalations_s: moments of full exhalation (k + 1,); a breath lies between each two.
        inhalations_s: moments of full inhalation (k,), one in each breath.
        depths: of the breaths (k,), their mean being 1.
        levels: where the breaths end (k + 1,), from the first one, in depths: the drift.
        phase: of each frame (n,), in breaths since the first full exhalation; NaN where no whole breath is.
        inhalation_phase: the share of a breath after which inhalation is full.
        notes: sentences on what a person should know.
    """

    exhalations_s: FloatArray
    inhalations_s: FloatArray
    depths: FloatArray
    levels: FloatArray
    phase: FloatArray
    inhalation_phase: float
    notes: tuple[str, ...] = ()

    def phase_at(self, times_s: FloatArray) -> FloatArray:
        """Phases (n,) at times (n,), as `phase`."""
        return Knots(self.exhalations_s, self.inhalations_s, inhalation_phase=self.inhalation_phase).phase(times_s)

    def depth_at(self, phase: FloatArray) -> FloatArray:
        """The depth (n,) of the breath in which a phase (n,) lies."""
        return np.asarray(self.depths[np.clip(phase.astype(np.int64), 0, len(self.depths) - 1)])

    def level_at(self, times_s: FloatArray) -> FloatArray:
        """The drift (n,) at times (n,): monotone from one full exhalation to the next."""
        return np.asarray(PchipInterpolator(self.exhalations_s, self.levels)(times_s))

    @property
    def rate_per_minute(self) -> float:
        """Breaths per minute, over all that are whole."""
        span = self.exhalations_s[-1] - self.exhalations_s[0]
        return float(60.0 * (len(self.exhalations_s) - 1) / span)


def find_cycles(tracks: Tracks, exhaled_at_s: float | None = None) -> Cycles:
    """Breaths in the motion of markers; drift, and breaths of different length and depth, are allowed for.

    Which end is exhalation is told by the tissue's staying there longer, unless a moment of exhalation is given.

    Raises:
        BadInput: the moment of exhalation is not in the recording.
        StageFailed: there are fewer than two whole breaths, or nothing repeats itself.
    """
    signal = breathing_signal(tracks)
    times = np.asarray(tracks.times_s)
    if exhaled_at_s is not None and not times[0] <= exhaled_at_s <= times[-1]:
        raise BadInput(
            f"The moment of exhalation must be in the recording, from {times[0]:g} to {times[-1]:g} s, not "
            f"{exhaled_at_s:g} s."
        )
    values, notes = _upright(signal, times, exhaled_at_s)
    period = _period(values, times)
    smooth = gaussian_filter1d(values, _SMOOTH * period * tracks.frames_per_s)
    tops, lows = _turns(smooth, period * tracks.frames_per_s)
    if len(tops) < 2 or len(lows) < 3:
        raise StageFailed(
            f"Fewer than two whole breaths are in the {times[-1] - times[0]:.1f} s recorded; record for longer.",
            Status.UNOBSERVABLE,
        )
    block = max(int(period * tracks.frames_per_s / _ENOUGH), 1)
    knots = fitted_knots(_means(times, block), _means(values, block), Knots(times[lows], times[tops]))
    return Cycles(
        knots.exhalations_s,
        knots.inhalations_s,
        knots.depths / knots.depths.mean(),
        (knots.levels - knots.levels[0]) / knots.depths.mean(),
        knots.phase(times),
        knots.inhalation_phase,
        notes,
    )


def _upright(signal: Signal, times: FloatArray, exhaled_at_s: float | None) -> tuple[FloatArray, tuple[str, ...]]:
    """The signal with exhalation low."""
    values = signal.values
    low, high = np.percentile(values, [5.0, 95.0])
    usual = np.median(values) if exhaled_at_s is None else np.interp(exhaled_at_s, times, values)
    lean = float(0.5 * (low + high) - usual)
    upright = values if lean > 0.0 else -values
    if exhaled_at_s is None and abs(lean) < _DWELL * (high - low):
        note = (
            "The tissue stays as long at one end of its way as at the other, so exhalation and inhalation may be "
            "exchanged; give a moment of exhalation."
        )
        return upright, (note,)
    return upright, ()


def _means(values: FloatArray, block: int) -> FloatArray:
    """Means of so many values after each other; what is left over at the end is left out."""
    whole = len(values) // block * block
    return np.asarray(values[:whole].reshape(-1, block).mean(axis=1))


def _period(values: FloatArray, times: FloatArray) -> float:
    """The time (s) after which the signal is most like itself."""
    step = float(np.median(np.diff(times)))
    centred = values - np.polynomial.Polynomial.fit(times, values, 1)(times)
    n = len(centred)
    products = np.fft.irfft(np.abs(np.fft.rfft(centred, 2 * n)) ** 2)[:n]
    # Not divided by the number of products, so that one breath wins against several.
    likeness = products / max(products[0], 1e-300)
    negative = np.flatnonzero(likeness < 0.0)
    if len(negative):
        tops, _ = find_peaks(likeness, height=_REPEATS)
        tops = tops[tops > negative[0]]
        if len(tops):
            return float(step * tops[np.argmax(likeness[tops])])
    raise StageFailed(
        "Nothing in the markers' motion repeats itself as breathing does, at least twice in the recording.",
        Status.UNOBSERVABLE,
    )


def _turns(smooth: FloatArray, period_frames: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Frames of full inhalation, and those of full exhalation before, between and after them."""
    extent = float(np.subtract(*np.percentile(smooth, [95.0, 5.0])))
    tops, _ = find_peaks(smooth, distance=max(_APART * period_frames, 1.0), prominence=_PROMINENT * extent)
    if len(tops) < 2:
        return tops, tops
    lows = [int(a + np.argmin(smooth[a:b])) for a, b in pairwise(tops)]
    # A breath at an end counts where its full exhalation is in the recording, and the rise that tells when it ended.
    before, after = smooth[: tops[0]], smooth[tops[-1] :]
    low, height = np.median(smooth[lows]), np.median(smooth[tops])
    full = low + _NEARLY * (height - low)
    if before.min() < full and np.argmin(before) > 0:
        lows.insert(0, int(np.argmin(before)))
    else:
        tops = tops[1:]
    if after.min() < full <= after[np.argmin(after) :].max():
        lows.append(int(tops[-1] + np.argmin(after)))
    else:
        tops = tops[:-1]
    return tops, np.array(lows)
