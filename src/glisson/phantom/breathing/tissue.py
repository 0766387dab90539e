"""A patch of liver with burnt marks, and how the lungs move it: every point by an affine map of its place."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core.arrays import FloatArray
from glisson.phantom.breathing.motion import Motion

TEXEL_MM = 0.1
_SIZE_MM = (200.0, 150.0)
_LIVER = np.array([0.50, 0.20, 0.15])
_PALE = np.array([0.72, 0.52, 0.40])
_BURNT = np.array([0.07, 0.05, 0.045])


@dataclass(frozen=True, eq=False)
class Tissue:
    """A patch before a camera. Places on it are (x, y) in mm from its middle.

    A place p is at middle + axes p + along (main + main_by_place p) + across (side + side_by_place p) in the
    camera's frame, mm; so the patch stays flat, and what a camera sees of it is a homography.

    Args:
        middle_mm: (3,) where the middle is at full exhalation.
        axes: (3, 2) directions of x and y.
        main_mm: (3,) how a full breath moves the middle.
        main_by_place: (3, 2) how much more or less it moves other places, mm per mm.
        side_mm: (3,) and
        side_by_place: (3, 2) the same across.
        marks_mm: (m, 2) places of the burnt marks.
        seed: of the texture.
    """

    middle_mm: FloatArray
    axes: FloatArray
    main_mm: FloatArray
    main_by_place: FloatArray
    side_mm: FloatArray
    side_by_place: FloatArray
    marks_mm: FloatArray
    seed: int

    def frames(self, motion: Motion, times_s: ArrayLike) -> FloatArray:
        """Matrices (…, 3, 3) that take (x, y, 1) to the camera's frame (mm) at times (…)."""
        along = np.asarray(motion.along(times_s))[..., None, None]
        across = np.asarray(motion.across(times_s))[..., None, None]
        rest = np.column_stack([self.axes, self.middle_mm])
        main = np.column_stack([self.main_by_place, self.main_mm])
        side = np.column_stack([self.side_by_place, self.side_mm])
        return np.asarray(rest + along * main + across * side)

    def marks_at(self, motion: Motion, times_s: FloatArray) -> FloatArray:
        """Places (…, m, 3) of the marks in the camera's frame (mm) at times (…, m), or (…, 1) for all the same."""
        flat = np.column_stack([self.marks_mm, np.ones(len(self.marks_mm))])
        return np.asarray((self.frames(motion, times_s) @ flat[:, :, None])[..., 0])

    @cached_property
    def texture(self) -> NDArray[np.uint8]:
        """What the patch looks like [row, column, red green blue], TEXEL_MM a side, its middle the patch's."""
        return _texture(self.marks_mm, np.random.default_rng([self.seed, 52]))


def draw_tissue(excursion_mm: float, random: np.random.Generator, marks: int = 20) -> Tissue:
    """A patch some 90 mm before the camera that a full breath moves by `excursion_mm`, mostly up in the image.

    How it lies, the way that it takes, how unevenly it moves, and the marks are drawn.
    """
    slant = random.normal(0.0, 0.12, 2)
    axes = np.array([[1.0, 0.0], [0.0, 1.0], slant])
    main = np.array([random.normal(0.0, 0.2), -1.0, random.normal(0.0, 0.12)])
    main *= excursion_mm / np.linalg.norm(main)
    side = 0.08 * excursion_mm * np.array([1.0, 0.0, random.normal(0.0, 0.3)])
    middle = np.array([0.0, 0.4 * excursion_mm, random.uniform(84.0, 96.0)])
    uneven = random.normal(0.0, 0.0012, (3, 2)) * excursion_mm
    places = _places(marks, random)
    return Tissue(middle, axes, main, uneven, side, 0.1 * uneven, places, int(random.integers(2**31)))


def _places(count: int, random: np.random.Generator) -> FloatArray:
    """Places on a loose grid of 84 × 34 mm, five in a row."""
    rows = int(np.ceil(count / 5))
    x, y = np.meshgrid(np.linspace(-42.0, 42.0, 5), np.linspace(-17.0, 17.0, max(rows, 2))[:rows])
    grid = np.column_stack([x.ravel(), y.ravel()])[:count]
    return np.asarray(grid + random.uniform(-3.0, 3.0, grid.shape))


def _texture(marks_mm: FloatArray, random: np.random.Generator) -> NDArray[np.uint8]:
    """Mottled liver with fine vessels and burnt marks, each of its own shape."""
    width, height = (round(size / TEXEL_MM) for size in _SIZE_MM)
    mottling = np.zeros((height, width), dtype=np.float32)
    for scale_mm, strength in ((0.5, 0.05), (1.5, 0.06), (5.0, 0.07), (20.0, 0.06)):
        mottling += strength * _noise(height, width, scale_mm, random)
    # Lines where slow noise changes its sign look like the vessels of the capsule.
    veins = np.exp(-((_noise(height, width, 8.0, random) / 0.03) ** 2))
    colour = _LIVER * (1.0 + mottling[:, :, None])
    colour += 0.25 * veins[:, :, None] * (np.array([0.38, 0.08, 0.08]) - colour)
    for place in marks_mm:
        _burn(colour, place, random)
    return np.asarray(np.clip(np.rint(255.0 * colour), 0.0, 255.0), dtype=np.uint8)


def _noise(height: int, width: int, scale_mm: float, random: np.random.Generator) -> NDArray[np.float32]:
    step = max(scale_mm / TEXEL_MM, 1.0)
    coarse = random.standard_normal((int(height / step) + 4, int(width / step) + 4)).astype(np.float32)
    smooth = cv2.resize(coarse, (width, height), interpolation=cv2.INTER_CUBIC)
    return np.asarray(smooth / smooth.std(), dtype=np.float32)


def _burn(colour: FloatArray, place: FloatArray, random: np.random.Generator) -> None:
    """A spot of charred tissue of 1.1 to 1.6 mm radius, out of round, in a pale rim."""
    radius, reach = random.uniform(1.1, 1.6), 4.0
    middle = place / TEXEL_MM + np.array([colour.shape[1], colour.shape[0]]) / 2.0 - 0.5
    low = np.floor(middle - reach / TEXEL_MM).astype(int)
    high = np.ceil(middle + reach / TEXEL_MM).astype(int) + 1
    down, across = np.mgrid[low[1] : high[1], low[0] : high[0]]
    x, y = (across - middle[0]) * TEXEL_MM, (down - middle[1]) * TEXEL_MM
    angle = np.arctan2(y, x)
    # No first harmonic: the spot's middle stays where it was asked for.
    shape = (
        1.0 + 0.10 * np.cos(2.0 * angle + random.uniform(0, 6.3)) + 0.06 * np.cos(3.0 * angle + random.uniform(0, 6))
    )
    away = np.hypot(x, y) / (radius * shape)
    spot, rim = _edge(away, 1.0), _edge(away, 1.5) - _edge(away, 1.0)
    part = colour[low[1] : high[1], low[0] : high[0]]
    part += spot[:, :, None] * (_BURNT - part) + 0.5 * rim[:, :, None] * (_PALE - part)


def _edge(away: FloatArray, at: float) -> FloatArray:
    return np.asarray(1.0 / (1.0 + np.exp((away - at) / 0.06)))
