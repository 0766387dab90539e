"""How far the tissue has been moved by the lungs at a time: irregular breaths, or a high-frequency ventilator.

Both give two numbers: `along` the main way of the tissue (0 full exhalation, about 1 full inhalation), and `across`,
zero at both ends of each breath, so that the tissue comes back by another way than it went (hysteresis).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from glisson.core.arrays import FloatArray

_INHALATION = 0.38
"""Share of a breath from full exhalation to full inhalation."""

_SLACKENING = 1.6
"""Exhalation slows down towards its end: the exponent of its half cosine."""


class Motion(Protocol):
    """What the lungs do."""

    def along(self, times_s: ArrayLike) -> FloatArray:
        """Displacement along the main way at times (any shape)."""

    def across(self, times_s: ArrayLike) -> FloatArray:
        """Displacement across it at times (any shape)."""


@dataclass(frozen=True, eq=False)
class Breaths:
    """Breath after breath, no two alike.

    Args:
        starts_s: moments of full exhalation (k + 1,); a breath lies between each two.
        depths: of the breaths (k,), about 1.
        levels: `along` at the moments of full exhalation (k + 1,), about 0: the drift, easing from one to the next.
    """

    starts_s: FloatArray
    depths: FloatArray
    levels: FloatArray

    def phase(self, times_s: ArrayLike) -> FloatArray:
        """Breaths since the first start, 0.0 being full exhalation; linear in time within a breath."""
        times = np.asarray(times_s, dtype=np.float64)
        return np.asarray(np.interp(times, self.starts_s, np.arange(len(self.starts_s), dtype=np.float64)))

    def along(self, times_s: ArrayLike) -> FloatArray:
        """As `Motion.along`."""
        phase = self.phase(times_s)
        breath = np.clip(phase.astype(np.int64), 0, len(self.depths) - 1)
        share = 0.5 - 0.5 * np.cos(np.pi * np.clip(phase - breath, 0.0, 1.0))
        drift = self.levels[breath] + share * (self.levels[breath + 1] - self.levels[breath])
        return np.asarray(drift + self._depth(phase) * waveform(phase % 1.0))

    def across(self, times_s: ArrayLike) -> FloatArray:
        """As `Motion.across`."""
        phase = self.phase(times_s)
        within = phase % 1.0
        rising = within < _INHALATION
        share = np.where(rising, within / _INHALATION, (1.0 - within) / (1.0 - _INHALATION))
        return np.asarray(self._depth(phase) * np.where(rising, 1.0, -1.0) * np.sin(np.pi * share) ** 2)

    def _depth(self, phase: FloatArray) -> FloatArray:
        return self.depths[np.clip(phase.astype(np.int64), 0, len(self.depths) - 1)]


@dataclass(frozen=True)
class Ventilator:
    """High-frequency ventilation: `rate_hz` strokes per second of one `depth`, the first begun at `start_s`."""

    rate_hz: float
    depth: float = 1.0
    start_s: float = 0.0

    def along(self, times_s: ArrayLike) -> FloatArray:
        """As `Motion.along`."""
        turn = 2.0 * np.pi * self.rate_hz * (np.asarray(times_s, dtype=np.float64) - self.start_s)
        return np.asarray(self.depth * (0.5 - 0.5 * np.cos(turn)))

    def across(self, times_s: ArrayLike) -> FloatArray:
        """As `Motion.across`."""
        turn = 2.0 * np.pi * self.rate_hz * (np.asarray(times_s, dtype=np.float64) - self.start_s)
        return np.asarray(self.depth * np.sin(turn))


def waveform(within: FloatArray) -> FloatArray:
    """A breath of depth 1 at phases in 0 to 1: a quick half cosine in, a slackening one out."""
    out = np.clip((within - _INHALATION) / (1.0 - _INHALATION), 0.0, 1.0)
    into = np.clip(within / _INHALATION, 0.0, 1.0)
    return np.asarray(
        np.where(
            within < _INHALATION, 0.5 - 0.5 * np.cos(np.pi * into), (0.5 + 0.5 * np.cos(np.pi * out)) ** _SLACKENING
        )
    )


@dataclass(frozen=True)
class Irregularity:
    """Standard deviations, relative to the mean: of a breath's length, of its depth, and of the level it ends at."""

    length: float = 0.12
    depth: float = 0.05
    level: float = 0.07


def draw_breaths(
    period_s: float, duration_s: float, irregularity: Irregularity, random: np.random.Generator
) -> Breaths:
    """Breaths that fill a recording: the first is begun before it, the last ends after it."""
    count = int(np.ceil(1.5 * duration_s / period_s)) + 4
    lengths = period_s * np.exp(irregularity.length * np.clip(random.standard_normal(count), -2.0, 2.0))
    starts = np.concatenate([[0.0], np.cumsum(lengths)]) - random.uniform(0.0, lengths[0])
    depths = 1.0 + irregularity.depth * np.clip(random.standard_normal(count), -2.0, 2.0)
    levels = irregularity.level * np.clip(random.standard_normal(count + 1), -2.0, 2.0)
    return Breaths(starts, depths, levels)
