"""A tip's path freed of noise: a Kalman filter forwards, the smoother of Rauch, Tung and Striebel (1965) backwards."""

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.core.tip_track import TipTrack

_SWING_MM_S = 200.0
"""Standard deviation of the velocity of which nothing is known yet."""


def smoothed(track: TipTrack, jerkiness: float = 40.0) -> TipTrack:
    """The most likely path of a tip, with what uncertainty it leaves at each time.

    A tip that is seen better counts more. The covariances that it leaves hold where the tips' errors are independent;
    an error that stays the same over the track, such as play, is in none of them.

    Args:
        track: as it was measured, each tip with an error of its own.
        jerkiness: how fast the velocity wanders, mm/s per √s.
    """
    if len(track) < 2:
        return track
    count = len(track)
    forecasts, means = np.zeros((count, 6)), np.zeros((count, 6))
    forecast_covs, covs = np.zeros((count, 6, 6)), np.zeros((count, 6, 6))
    steps = [np.eye(6)] + [_step(dt) for dt in np.diff(track.times_s)]
    mean = np.concatenate([track.points_mm[0], np.zeros(3)])
    cov = np.diag([1e6] * 3 + [_SWING_MM_S**2] * 3)
    seen = np.eye(3, 6)
    for n in range(count):
        if n:
            mean = steps[n] @ mean
            cov = steps[n] @ cov @ steps[n].T + _wandering(track.times_s[n] - track.times_s[n - 1], jerkiness)
        forecasts[n], forecast_covs[n] = mean, cov
        gain = np.linalg.solve(seen @ cov @ seen.T + track.covariance_mm2[n], seen @ cov).T
        mean = mean + gain @ (track.points_mm[n] - mean[:3])
        # Joseph's form stays symmetric and positive.
        keep = np.eye(6) - gain @ seen
        cov = keep @ cov @ keep.T + gain @ track.covariance_mm2[n] @ gain.T
        means[n], covs[n] = mean, cov
    for n in range(count - 2, -1, -1):
        gain = np.linalg.solve(forecast_covs[n + 1], steps[n + 1] @ covs[n]).T
        means[n] += gain @ (means[n + 1] - forecasts[n + 1])
        covs[n] += gain @ (covs[n + 1] - forecast_covs[n + 1]) @ gain.T
    return TipTrack(track.instrument, track.frame, track.times_s, means[:, :3], covs[:, :3, :3])


def _step(dt: float) -> FloatArray:
    step = np.eye(6)
    step[:3, 3:] = dt * np.eye(3)
    return step


def _wandering(dt: float, jerkiness: float) -> FloatArray:
    block = np.array([[dt**3 / 3.0, dt**2 / 2.0], [dt**2 / 2.0, dt]])
    wandering: FloatArray = jerkiness**2 * np.kron(block, np.eye(3))
    return wandering
