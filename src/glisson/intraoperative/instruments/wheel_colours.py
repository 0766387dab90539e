"""Reads the colours of a wheel's sectors, each against the white paper beside it."""

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.camera import Camera
from glisson.core.instruments import RINGS, SECTORS
from glisson.core.marker_colours import MARKER_COLOURS
from glisson.core.transform import RigidTransform
from glisson.intraoperative.cameras.projection import project

_HUES = {"red": 0.0, "yellow": 53.0, "green": 138.0, "blue": 222.0}
"""Hues in degrees under white light."""
_NEAR_HUE = 30.0
_LEAST_SATURATION = 0.45
_LEAST_VALUE = {"red": 0.69, "yellow": 0.69, "green": 0.25, "blue": 0.35}
"""Shares of white's light. Blood is darker than red ink, and on yellow it would make red."""
_GAMMA = 1.5
"""Between none and what most cameras have: the higher it is, the paler are all colours in the image."""
_DEGREES = 360
_RADII = 9
_READABLE = 0.2
"""So much of a sector must be of some colour."""
_SURE = 0.7
"""And so much of that of the same one."""


def read_sectors(
    image: NDArray[np.uint8], camera: Camera, trocar_from_wheel: RigidTransform, radius_mm: float
) -> tuple[tuple[str | None, ...], float]:
    """The colours of the sectors anticlockwise, and the angle (rad) where the first begins.

    A colour is None where it cannot be read. The wheel may be turned in any way; the angle, below 60°, is from the x of
    the given pose.

    Args:
        image: (h, w, 3).
        camera: its camera.
        trocar_from_wheel: the pose, whatever the turn about the axis.
        radius_mm: the wheel's radius.
    """
    labels = _labels(image, camera, trocar_from_wheel, radius_mm)
    one_hot = np.stack([labels == number for number in range(len(MARKER_COLOURS))]).sum(axis=1)
    wide = _DEGREES // SECTORS
    best, begin = -1, 0
    for shift in range(wide):
        counts = np.roll(one_hot, -shift, axis=1).reshape(len(MARKER_COLOURS), SECTORS, wide).sum(axis=2)
        # Squares, so that a boundary off its place costs more than what is gained beside it.
        agreeing = int((counts.max(axis=0) ** 2).sum())
        if agreeing > best:
            best, begin = agreeing, shift
    counts = np.roll(one_hot, -begin, axis=1).reshape(len(MARKER_COLOURS), SECTORS, wide).sum(axis=2)
    return tuple(_colour(counts[:, sector], wide * _RADII) for sector in range(SECTORS)), float(np.radians(begin))


def paper_colour(
    image: NDArray[np.uint8], camera: Camera, trocar_from_wheel: RigidTransform, radius_mm: float
) -> FloatArray:
    """What the wheel's white paper looks like (3,): the brighter half of its outer ring."""
    ring = _white_ring(image, camera, trocar_from_wheel, radius_mm)
    brightness = ring.min(axis=1)
    colour: FloatArray = np.median(ring[brightness >= np.median(brightness)], axis=0).clip(1.0)
    return colour


def _colour(counts: NDArray[np.intp], all_of_it: int) -> str | None:
    readable, most = counts.sum(), counts.max()
    if readable < _READABLE * all_of_it or most < _SURE * readable:
        return None
    return MARKER_COLOURS[int(counts.argmax())]


def _labels(image: NDArray[np.uint8], camera: Camera, pose: RigidTransform, radius_mm: float) -> NDArray[np.int_]:
    """The colour's number (radii, degrees) at places of the sectors, −1 where there is none."""
    margin = 0.2 * (RINGS.outer - RINGS.inner)
    radii = np.linspace(RINGS.inner + margin, RINGS.outer - margin, _RADII)
    ink = _seen(image, camera, pose, radii * radius_mm)
    white = _white(_white_ring(image, camera, pose, radius_mm))
    shares = (ink / white) ** _GAMMA
    value, least = shares.max(axis=2), shares.min(axis=2)
    chroma = np.maximum(value - least, 1e-6)
    red, green, blue = np.moveaxis(shares, 2, 0)
    from_green_on = np.where(value == green, 2.0 + (blue - red) / chroma, 4.0 + (red - green) / chroma)
    sixth = np.where(value == red, (green - blue) / chroma, from_green_on)
    hue = 60.0 * sixth % 360.0
    off = np.stack([np.abs((hue - centre + 180.0) % 360.0 - 180.0) for centre in _HUES.values()])
    labels = off.argmin(axis=0)
    bright = value > np.array(list(_LEAST_VALUE.values()))[labels]
    clear = (off.min(axis=0) < _NEAR_HUE) & bright & (chroma > _LEAST_SATURATION * value)
    return np.where(clear, labels, -1)


def _white_ring(image: NDArray[np.uint8], camera: Camera, pose: RigidTransform, radius_mm: float) -> FloatArray:
    """The image (degrees, 3) in the middle of the outer white ring."""
    ring: FloatArray = _seen(image, camera, pose, np.array([0.5 * (RINGS.white + RINGS.outer)]) * radius_mm)[0]
    return ring


def _white(ring: FloatArray) -> FloatArray:
    """What white paper looks like (degrees, 3) at each angle: the ring, without what lies over it, smoothed."""
    brightness = ring.min(axis=1)
    clean = brightness > 0.75 * np.percentile(brightness, 75)
    weights = np.where(clean, 1.0, 1e-6)
    kernel = np.hanning(91)
    kernel /= kernel.sum()

    def smoothed(values: FloatArray) -> FloatArray:
        wrapped = np.concatenate([values[-45:], values, values[:45]])
        return np.convolve(wrapped, kernel, mode="valid")

    total = smoothed(weights)
    return np.stack([smoothed(weights * ring[:, n]) / total for n in range(3)], axis=1).clip(8.0)


def _seen(image: NDArray[np.uint8], camera: Camera, pose: RigidTransform, radii_mm: FloatArray) -> FloatArray:
    """The image (radii, degrees, 3) at circles about the wheel's centre."""
    angles = np.radians(np.arange(_DEGREES) + 0.5)
    round_ = np.stack([np.cos(angles), np.sin(angles), np.zeros(_DEGREES)], axis=1)
    places = project(camera, pose, (radii_mm[:, None, None] * round_).reshape(-1, 3)).reshape(-1, _DEGREES, 2)
    x, y = np.moveaxis(places.astype(np.float32), 2, 0)
    return cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT).astype(np.float64)
