"""What comes between: an instrument that passes, a trickle of blood, and glare on the wet capsule."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray

_STEEL = (0.55, 0.56, 0.58)
_BLOOD = (0.30, 0.02, 0.02)
_BITS = 4
"""Fractional bits of drawn positions."""


@dataclass(frozen=True)
class Passing:
    """Something opaque that goes over the image.

    Args:
        kind: "instrument", a rod from the right border, or "blood", an oval.
        begins_s: when it begins to move in.
        ends_s: when it is gone.
        place_px: (u, v) where its tip or middle is half-way.
        size_px: the rod's width or the oval's larger radius.
    """

    kind: str
    begins_s: float
    ends_s: float
    place_px: tuple[float, float]
    size_px: float

    def cover(self, time_s: float, shape: tuple[int, int]) -> NDArray[np.uint8] | None:
        """How opaque it is at each pixel, 0 to 255; None before it comes and after it is gone."""
        if not self.begins_s < time_s < self.ends_s:
            return None
        share = float(np.sin(np.pi * (time_s - self.begins_s) / (self.ends_s - self.begins_s)) ** 0.5)
        mask = np.zeros(shape, dtype=np.uint8)
        if self.kind == "instrument":
            tip = (shape[1] + 40.0 - share * (shape[1] + 40.0 - self.place_px[0]), self.place_px[1])
            cv2.line(
                mask, _fixed(tip), _fixed((shape[1] + 200.0, tip[1] + 60.0)), 255, int(self.size_px), cv2.LINE_AA, _BITS
            )
        else:
            axes = _fixed((share * self.size_px, 0.55 * share * self.size_px))
            cv2.ellipse(mask, _fixed(self.place_px), axes, 20.0, 0.0, 360.0, 255, -1, cv2.LINE_AA, _BITS)
        return mask

    @property
    def colour(self) -> tuple[float, float, float]:
        """Its red, green and blue."""
        return _STEEL if self.kind == "instrument" else _BLOOD


@dataclass(frozen=True, eq=False)
class Glare:
    """Bright reflexes (n, 2) px, of radii (n,) px, that go `follows` as far as the tissue does."""

    places_px: FloatArray
    radii_px: FloatArray
    follows: float = 0.5

    def add(self, light: NDArray[np.float32], moved_px: FloatArray) -> None:
        """Put the reflexes into light [row, column, red green blue], the tissue having moved by (2,) px."""
        height, width = light.shape[:2]
        for place, radius in zip(self.places_px + self.follows * moved_px, self.radii_px, strict=True):
            low = np.maximum(np.floor(place - 3.0 * radius).astype(int), 0)
            high = np.minimum(np.ceil(place + 3.0 * radius).astype(int) + 1, [width, height])
            if (low < high).all():
                down, across = np.mgrid[low[1] : high[1], low[0] : high[0]]
                square = ((across - place[0]) ** 2 + 2.0 * (down - place[1]) ** 2) / radius**2
                light[low[1] : high[1], low[0] : high[0]] += (1.6 * np.exp(-square)).astype(np.float32)[:, :, None]


def draw_passing(duration_s: float, shape: tuple[int, int], random: np.random.Generator) -> tuple[Passing, ...]:
    """An instrument and some blood, each once, that cover some of the marks for a second or so."""
    made = []
    for kind, size in (("instrument", 0.06 * shape[1]), ("blood", 0.09 * shape[1])):
        begins = random.uniform(0.15, 0.6) * duration_s
        place = (random.uniform(0.35, 0.7) * shape[1], random.uniform(0.35, 0.65) * shape[0])
        made.append(Passing(kind, begins, begins + random.uniform(0.12, 0.25) * duration_s, place, size))
    return tuple(made)


def draw_glare(shape: tuple[int, int], random: np.random.Generator, count: int = 7) -> Glare:
    """Reflexes all over the image."""
    places = random.uniform([0.1, 0.1], [0.9, 0.9], (count, 2)) * np.array([shape[1], shape[0]])
    return Glare(places, random.uniform(0.006, 0.016, count) * shape[1])


def _fixed(point: tuple[float, float]) -> tuple[int, int]:
    return round(point[0] * 2**_BITS), round(point[1] * 2**_BITS)
