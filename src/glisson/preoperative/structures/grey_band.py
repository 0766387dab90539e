"""The range of grey values of what was clicked: up to half-way to the tissues about it.

Half-way is where the scanner's blur puts the border between two tissues, however large the structure is. A click may
lie near that border, so what was clicked is looked for in a ball about it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

_APART = 3.0
"""Another tissue differs by so many standard deviations of the noise."""

_LEAST = 2.5
"""The band reaches at least so many of them to either side."""

_LEAST_SHARE = 0.02
"""Part of the surroundings that a tissue has, or it is none worth a peak."""

_FARTHER = 70.0

_FAR = 3.0
"""Away from the tissue that it stands out from, a band reaches so many times as far: tumours are necrotic in parts."""

_LEAST_NEAR = 0.2
"""Part of what is near to a click that must stand out: near a border it is less than half, by noise a few voxels."""

_BINS = 64
_ROUNDS = 20


@dataclass(frozen=True)
class GreyBand:
    """The grey value of what was clicked, and the lowest and highest that count as the same."""

    grey: float
    low: float
    high: float

    def holds(self, values: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Which values lie in the band."""
        inside: NDArray[np.bool_] = (values >= self.low) & (values <= self.high)
        return inside


def band_against(reference: float, near: NDArray[np.float32], clicked: float, noise: float) -> GreyBand | None:
    """The band of what stands out from a tissue on the click's side; None where hardly anything does.

    Args:
        reference: the tissue's grey value.
        near: grey values about the click.
        clicked: that of the click, which says whether darker or brighter than the tissue.
        noise: standard deviation of the grey values.
    """
    side = 1.0 if clicked >= reference else -1.0
    others = near[side * (near - reference) > _APART * noise]
    if len(others) < _LEAST_NEAR * len(near):
        return None
    # Values between the two tissues are those of voxels on the border: what was clicked is among the farther ones.
    start = reference + side * float(np.percentile(side * (others - reference), _FARTHER))
    grey = settled(start, others, max(_APART * noise, 0.25 * abs(start - reference)))
    half = max(0.5 * abs(grey - reference), _LEAST * noise)
    far = _FAR * half
    return GreyBand(grey, grey - (far if side < 0.0 else half), grey + (far if side > 0.0 else half))


def band_among(about: NDArray[np.float32], grey: float, noise: float, most: float) -> GreyBand:
    """The band up to half-way to the most frequent tissues to either side, at most so far.

    Args:
        about: grey values farther about the click.
        grey: that of what was clicked.
        noise: standard deviation of the grey values.
        most: how far the band reaches at most to either side.
    """
    below, above = (_half_way(side * (about - grey), noise, most) for side in (-1.0, 1.0))
    return GreyBand(grey, grey - below, grey + above)


def settled(start: float, values: NDArray[np.float32], width: float) -> float:
    """The frequent value nearest to a start (mean shift, Comaniciu and Meer 2002, IEEE PAMI 24:603)."""
    found = start
    for _ in range(_ROUNDS):
        same = values[np.abs(values - found) <= width]
        if not len(same) or abs(float(same.mean()) - found) < 1e-3 * width:
            break
        found = float(same.mean())
    return found


def frequent(values: NDArray[np.float32]) -> float:
    """The most frequent of many values."""
    low, high = np.percentile(values, (1.0, 99.0))
    counts, edges = np.histogram(values, _BINS, (float(low), float(high) + 1e-3))
    peak = int(np.argmax(ndimage.gaussian_filter1d(counts.astype(np.float64), 2.0)))
    return 0.5 * float(edges[peak] + edges[peak + 1])


def _half_way(differences: NDArray[np.float32], noise: float, most: float) -> float:
    """Half the difference (positive) of the most frequent tissue on one side, kept within what noise allows."""
    others = differences[differences > _APART * noise]
    if len(others) <= _LEAST_SHARE * len(differences):
        return min(_APART * noise, most)
    return float(np.clip(0.5 * frequent(others), _LEAST * noise, most))
