"""What breathing does to each marker as a function of phase, so that it can be taken away at every phase."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from glisson.core.arrays import FloatArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status
from glisson.core.tracks import Tracks
from glisson.intraoperative.breathing.cycles import Cycles
from glisson.intraoperative.breathing.signal import breathing_signal
from glisson.intraoperative.breathing.waveform import periodic_basis

_DEGREE = 3
_BREATHS_A_PIECE = 4
_LOST_SIGMAS = 20.0
"""What the others say of a lost marker is so much less certain than what is seen of it."""

_LEAST_SHARE = 2.0
"""A marker needs so many times as many frames in which it is seen as its model has numbers."""


@dataclass(frozen=True, eq=False)
class BreathingModel:
    """place(t) = home + drift(t) + depth of the breath × way(phase), for each of m markers.

    The way is a closed curve through 0 at full exhalation, so that the tissue may come back by another way than it
    went. The drift is a share of that of all markers, and a slow curve with a piece for every four breaths. Places are
    in the unit of the tracks.

    Args:
        cycles: the breaths.
        ways: coefficients (pieces, m, 2) of the ways.
        drifts: coefficients (pieces, m, 2) of home and drift.
        covariance: (m, 2, 2) of what the model leaves of a marker's places; NaN for markers that have no model.
    """

    cycles: Cycles
    ways: FloatArray
    drifts: FloatArray
    covariance: FloatArray

    def way(self, phase: FloatArray) -> FloatArray:
        """Displacement (n, m, 2) from full exhalation at phases (n,) of a breath of mean depth."""
        return np.asarray(np.tensordot(_way_basis(phase), self.ways, axes=1))

    def breathing(self, times_s: FloatArray) -> FloatArray:
        """Displacement (n, m, 2) by breathing from full exhalation at times (n,); NaN outside whole breaths."""
        phase = self.cycles.phase_at(times_s)
        inside = np.isfinite(phase)
        displacement = np.full((len(phase), *self.ways.shape[1:]), np.nan)
        depth = self.cycles.depth_at(phase[inside])
        displacement[inside] = depth[:, None, None] * self.way(phase[inside])
        return displacement

    def drift(self, times_s: FloatArray) -> FloatArray:
        """Places (n, m, 2) of full exhalation at times (n,); NaN outside whole breaths."""
        inside = np.isfinite(self.cycles.phase_at(times_s))
        places = np.full((len(times_s), *self.drifts.shape[1:]), np.nan)
        basis = _drift_basis(np.asarray(times_s)[inside], self.cycles)
        places[inside] = np.tensordot(basis, self.drifts, axes=1)
        return places

    def excursions(self) -> FloatArray:
        """How far (m,) each marker goes: the largest distance between two places of its way."""
        way = self.way(np.linspace(0.0, 1.0, 200, endpoint=False))
        apart = np.linalg.norm(way[:, None] - way[None, :], axis=3)
        return np.asarray(apart.max(axis=(0, 1)))

    def gate(self, times_s: FloatArray, within: float) -> NDArray[np.bool_]:
        """Which frames (n,) to use: breathing has moved no marker further than `within` from full exhalation."""
        moved = np.linalg.norm(self.breathing(times_s), axis=2)
        known = np.isfinite(self.covariance[:, 0, 0])
        return np.asarray((moved[:, known] <= within).all(axis=1))


def fit_breathing(tracks: Tracks, cycles: Cycles) -> BreathingModel:
    """Least squares of each marker's places, weighed by their covariance.

    Raises:
        StageFailed: no marker is seen in enough frames of whole breaths.
    """
    inside = np.isfinite(cycles.phase)
    times, phase = tracks.times_s[inside], cycles.phase[inside]
    ways = cycles.depth_at(phase)[:, None] * _way_basis(phase)
    design = np.hstack([ways, _drift_basis(times, cycles)])
    count = tracks.states.shape[1]
    solution = np.full((design.shape[1], count, 2), np.nan)
    covariance = np.full((count, 2, 2), np.nan)
    signal = breathing_signal(tracks)
    for place, marker in enumerate(signal.markers):
        seen = tracks.seen[inside, marker]
        if seen.sum() < _LEAST_SHARE * design.shape[1]:
            continue
        spread = np.sqrt(np.trace(tracks.covariance[inside, marker], axis1=1, axis2=2) / 2.0)
        # Where it is lost the others say roughly where it is: it may be lost at one phase in every breath.
        sigma = np.where(seen, spread, _LOST_SIGMAS * np.nanmedian(spread))
        places = np.where(seen[:, None], tracks.places[inside, marker], signal.filled[inside, place])
        # The constant of the way is 0 by definition; the least of all solutions leaves it so.
        weighed = design / sigma[:, None]
        solution[:, marker] = np.linalg.lstsq(weighed, places / sigma[:, None], rcond=1e-9)[0]
        off = (places - design @ solution[:, marker])[seen]
        covariance[marker] = off.T @ off / max(len(off) - design.shape[1], 1)
    if np.isnan(covariance).all():
        raise StageFailed("No marker is seen in enough frames of whole breaths.", Status.UNOBSERVABLE)
    return BreathingModel(cycles, solution[: ways.shape[1]], solution[ways.shape[1] :], covariance)


def _way_basis(phase: FloatArray) -> FloatArray:
    return np.asarray(periodic_basis(phase) - periodic_basis(np.zeros(1)))


def _drift_basis(times_s: FloatArray, cycles: Cycles) -> FloatArray:
    """The common drift, and cubic B-splines for what a marker does beside it: (n, 1 + pieces + 3)."""
    first, last = cycles.exhalations_s[0], cycles.exhalations_s[-1]
    pieces = max(len(cycles.depths) // _BREATHS_A_PIECE, 1)
    step = (last - first) / pieces
    knots = first + step * np.arange(-_DEGREE, pieces + _DEGREE + 1)
    # Rounding may put a frame a hair beside the splines.
    inside = np.clip(times_s, first + 1e-9 * step, last - 1e-9 * step)
    splines = BSpline.design_matrix(inside, knots, _DEGREE).toarray()
    return np.column_stack([cycles.level_at(times_s), splines])
