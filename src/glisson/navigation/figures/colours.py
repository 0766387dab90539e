"""Colours that people with any colour vision can tell apart (Okabe and Ito 2008), and the displacement scale."""

import matplotlib
import numpy as np

from glisson.core.arrays import FloatArray
from glisson.navigation.rendering.bodies import Palette

Rgb = tuple[float, float, float]

BLACK: Rgb = (0.10, 0.10, 0.12)
ORANGE: Rgb = (0.90, 0.62, 0.00)
SKY: Rgb = (0.34, 0.71, 0.91)
GREEN: Rgb = (0.00, 0.62, 0.45)
YELLOW: Rgb = (0.94, 0.89, 0.26)
BLUE: Rgb = (0.00, 0.45, 0.70)
VERMILLION: Rgb = (0.84, 0.37, 0.00)
PURPLE: Rgb = (0.80, 0.47, 0.65)

LIVER: Rgb = (0.86, 0.64, 0.55)
REMOVED: Rgb = (0.96, 0.78, 0.36)
LEVER: Rgb = (0.80, 0.62, 0.40)
TUMOUR, PLANE, WIRE = VERMILLION, GREEN, BLACK

_STRUCTURES = {
    "portal": BLUE,
    "hepatic": SKY,
    "artery": PURPLE,
    "duct": YELLOW,
    "wire": (1.0, 1.0, 1.0),
    "stent": (0.75, 0.75, 0.75),
    "gallbladder": (0.55, 0.70, 0.30),
    "ivc": (0.50, 0.62, 0.80),
}
_OTHERS = (PURPLE, YELLOW, SKY, ORANGE)


def structure_colour(name: str) -> Rgb:
    """Colour of a vessel tree or another structure by its name; the same name always has the same colour."""
    kind = kind_of(name)
    return _STRUCTURES.get(kind, _OTHERS[sum(kind.encode()) % len(_OTHERS)])


def is_outlined(name: str) -> bool:
    """Whether a structure is outlined on slices: what lies in or at the liver, not skin or bones around it."""
    return kind_of(name) in _STRUCTURES


def kind_of(name: str) -> str:
    """The name without a number that tells pieces of one kind apart: "artery 3" is an "artery"."""
    return name.rstrip("0123456789").rstrip(" -_") or name


def displacement_colours(largest_mm: float) -> Palette:
    """Viridis, a quarter paler so that the organ stays see-through, from 0 to `largest_mm`."""
    table = 0.25 + 0.75 * matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, 256))[:, :3]
    scale = 255.0 / max(largest_mm, 1e-9)

    def colours(values: FloatArray) -> FloatArray:
        chosen: FloatArray = table[np.clip(values * scale, 0.0, 255.0).astype(np.int64)]
        return chosen

    return colours


def side_colours(values: FloatArray) -> FloatArray:
    """Colours of the remaining (value < 0) and the removed side of a plane, with the cut as a line; values in mm."""
    colours = np.where(values[:, None] > 0.0, np.array(REMOVED), np.array(LIVER))
    colours[np.abs(values) < 0.9] = np.array(PLANE) * 0.75
    return colours
