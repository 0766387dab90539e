"""How far a ventilator's strokes move the tissue at a given rate, and whether the recording can tell."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput, StageFailed
from glisson.core.status import Status
from glisson.core.tracks import Tracks
from glisson.intraoperative.breathing.signal import breathing_signal

_LEAST_STROKES = 8
_RATE_SHARE, _RATE_STEPS = 0.01, 21
"""Ventilators keep their rate to within this share; the rate that explains most is taken."""

AVERAGED_SHARE = 0.4
"""An exposure may take this share of a stroke; then three quarters of the motion are left (sinc 0.4 = 0.76)."""

_DRIFT = 3
"""Coefficients of the polynomial in time that takes drift away."""

_REPEATED = 0.3
"""A frame in which the markers moved by less than this share of their standard deviation is the one before again."""


@dataclass(frozen=True)
class Displacement:
    """Peak-to-peak displacement at a rate.

    Args:
        rate_hz: strokes per second.
        value: twice the amplitude of the fundamental, root mean square over the markers, in the unit of the tracks; NaN
            where too few markers could be followed.
        sigma: its standard deviation by the scatter of the tracks.
        frames_per_s: different pictures per second.
        status: unobservable where frame rate or shutter cannot resolve the rate, or no marker could be followed.
        reasons: of that, as sentences.
    """

    rate_hz: float
    value: float
    sigma: float
    frames_per_s: float
    status: Status
    reasons: tuple[str, ...] = ()


def displacement_at(tracks: Tracks, rate_hz: float, exposure_s: float | None = None) -> Displacement:
    """The displacement at the rate to which the ventilator is set.

    What an exposure averages away is put back (by the sinc of the share of a stroke that it takes). An unknown exposure
    is taken as half of the time between frames.

    Raises:
        BadInput: the rate or the exposure is not positive.
        StageFailed: the recording has too few strokes.
    """
    _check(tracks, rate_hz, exposure_s)
    try:
        filled = breathing_signal(tracks).filled
    except StageFailed as error:
        return Displacement(rate_hz, np.nan, np.nan, tracks.frames_per_s, Status.UNOBSERVABLE, (str(error),))
    fresh = fresh_frames(tracks)
    frames_per_s = tracks.frames_per_s * float(fresh.mean())
    exposure = 0.5 / frames_per_s if exposure_s is None else exposure_s
    reasons = _reasons(tracks, rate_hz, frames_per_s, exposure)
    times = (tracks.times_s - tracks.times_s.mean())[fresh]
    places = filled[fresh].reshape(len(times), -1)
    fits = [_fundamental(times, places, rate) for rate in _rates(rate_hz, times)]
    power, sigma = max(fits)
    left = float(np.sinc(rate_hz * exposure))
    scale = 2.0 / max(abs(left), 1e-3)
    return Displacement(
        rate_hz,
        scale * power,
        scale * sigma,
        frames_per_s,
        Status.UNOBSERVABLE if reasons else Status.CONVERGED,
        reasons,
    )


def fresh_frames(tracks: Tracks) -> NDArray[np.bool_]:
    """Which frames (n,) are pictures of their own; recorders that are faster than the camera repeat the one before.

    Noise moves the markers from each picture to the next, even where the tissue stands still.
    """
    moves = np.linalg.norm(np.diff(tracks.places, axis=0), axis=2)
    sigma = np.sqrt(np.trace(tracks.covariance[1:], axis1=2, axis2=3))
    known = np.isfinite(moves)
    moved = np.where(known, moves / np.where(known, sigma, 1.0), np.inf)
    # The middle marker of those that are seen: one that has just been found again may still settle.
    middle = np.sort(moved, axis=1)[np.arange(len(moved)), known.sum(axis=1) // 2]
    return np.append(True, middle > _REPEATED)


def _check(tracks: Tracks, rate_hz: float, exposure_s: float | None) -> None:
    if not (np.isfinite(rate_hz) and rate_hz > 0.0):
        raise BadInput(f"A ventilation rate must be positive, not {rate_hz} Hz.")
    if exposure_s is not None and not (np.isfinite(exposure_s) and exposure_s > 0.0):
        raise BadInput(f"An exposure must be positive, not {exposure_s} s.")
    strokes = rate_hz * (tracks.times_s[-1] - tracks.times_s[0])
    if strokes < _LEAST_STROKES:
        raise StageFailed(
            f"The recording has {strokes:.1f} strokes at {rate_hz:g} Hz where {_LEAST_STROKES} are needed; record for "
            "longer.",
            Status.UNOBSERVABLE,
        )


def _reasons(tracks: Tracks, rate_hz: float, frames_per_s: float, exposure_s: float) -> tuple[str, ...]:
    reasons = []
    # Within one over the duration of half the frame rate, sine and cosine can't be told from each other.
    if rate_hz > 0.5 * frames_per_s - 1.0 / (tracks.times_s[-1] - tracks.times_s[0]):
        reasons.append(
            f"{frames_per_s:.1f} pictures per second cannot resolve {rate_hz:g} Hz; more than {2.0 * rate_hz:.0f} are "
            "needed."
        )
    if rate_hz * exposure_s > AVERAGED_SHARE:
        reasons.append(
            f"An exposure of {1e3 * exposure_s:.0f} ms averages over {rate_hz * exposure_s:.2f} of a stroke at "
            f"{rate_hz:g} Hz; it must be shorter than {1e3 * AVERAGED_SHARE / rate_hz:.0f} ms."
        )
    return tuple(reasons)


def _rates(rate_hz: float, times: FloatArray) -> FloatArray:
    """Rates to be tried: no finer than the recording can tell apart."""
    reach = _RATE_SHARE * rate_hz
    if reach < 0.2 / (times[-1] - times[0]):
        return np.array([rate_hz])
    return rate_hz + np.linspace(-reach, reach, _RATE_STEPS)


def _fundamental(times: FloatArray, places: FloatArray, rate_hz: float) -> tuple[float, float]:
    """Amplitude of the common fundamental, root mean square over the markers, and its standard deviation.

    All markers swing in one phase; what noise adds to the amplitude, which is never negative, is taken off.
    """
    turn = 2.0 * np.pi * rate_hz * times
    design = np.column_stack([np.cos(turn), np.sin(turn), np.vander(times, _DRIFT)])
    solution = np.linalg.lstsq(design, places, rcond=None)[0]
    off = places - design @ solution
    count = places.shape[1] // 2
    noise = float((off**2).sum() / ((len(times) - design.shape[1]) * places.shape[1]))
    variance = noise * max(float(np.linalg.pinv(design.T @ design)[0, 0]), 0.0)
    largest = float(np.linalg.svd(solution[:2].T, compute_uv=False)[0])
    square = max(largest**2 - places.shape[1] * variance, 0.0)
    return float(np.sqrt(square / count)), float(np.sqrt(variance / count))
