"""The light of single rays that meet an instrument's wheel, its shaft, or what lies over them."""

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.core.instruments import RINGS
from glisson.geometry.compiled import compiled

SAMPLES = 3
"""Rays a side for each pixel about the wheel."""

_WHITE, _BLACK, _HUB = 0.86, 0.05, 0.15
_WHITE_TO, _INK_TO, _INK_FROM, _HOLE = RINGS
_BLOOD_RED, _BLOOD_ELSE = 0.34, 0.035


@compiled
def add_light(
    light: FloatArray,
    slopes: FloatArray,
    box: NDArray[np.int64],
    rotation: FloatArray,
    centre: FloatArray,
    radius: float,
    shaft_radius: float,
    inks: FloatArray,
    lit: FloatArray,
    fingers: FloatArray,
    blood: FloatArray,
    glare: FloatArray,
) -> None:
    """Put wheel, shaft and fingers before what is in `light` (rows, columns, 3).

    Args:
        light: in and out.
        slopes: of the ray (rows, columns, 2) through each pixel's middle.
        box: rows and columns with `SAMPLES` rays a side; elsewhere there is one.
        rotation: (3, 3) of the instrument in the camera's frame.
        centre: (3,) of the wheel, mm.
        radius: of the wheel, mm.
        shaft_radius: mm.
        inks: colours (6, 3) of the sectors.
        lit: colour of the light (3,), and its relative change over a wheel radius (2,).
        fingers: (n, 7) direction (2,), reach, half width, colour (3,).
        blood: (n, 4) place, radius, strength, in wheel radii.
        glare: (n, 4) the same.
    """
    rows, columns = slopes.shape[:2]
    seen = np.zeros(3)
    total = np.zeros(3)
    for row in range(rows):
        for column in range(columns):
            samples = SAMPLES if box[0] <= row < box[1] and box[2] <= column < box[3] else 1
            # Within one pixel slopes change evenly to 1e-7.
            below, right = min(row, rows - 2), min(column, columns - 2)
            x, y = slopes[row, column, 0], slopes[row, column, 1]
            x_down = slopes[below + 1, column, 0] - slopes[below, column, 0]
            y_down = slopes[below + 1, column, 1] - slopes[below, column, 1]
            x_across = slopes[row, right + 1, 0] - slopes[row, right, 0]
            y_across = slopes[row, right + 1, 1] - slopes[row, right, 1]
            total[:] = 0.0
            for i in range(samples):
                down = (i + 0.5) / samples - 0.5
                for j in range(samples):
                    across = (j + 0.5) / samples - 0.5
                    for channel in range(3):
                        seen[channel] = light[row, column, channel]
                    _ray(
                        seen, x + down * x_down + across * x_across, y + down * y_down + across * y_across,
                        rotation, centre, radius, shaft_radius, inks, lit, fingers, blood, glare,
                    )  # fmt: skip
                    for channel in range(3):
                        total[channel] += seen[channel]
            for channel in range(3):
                light[row, column, channel] = total[channel] / samples**2


@compiled
def _ray(
    seen: FloatArray,
    x: float,
    y: float,
    rotation: FloatArray,
    centre: FloatArray,
    radius: float,
    shaft_radius: float,
    inks: FloatArray,
    lit: FloatArray,
    fingers: FloatArray,
    blood: FloatArray,
    glare: FloatArray,
) -> None:
    ax, ay, az = rotation[0, 2], rotation[1, 2], rotation[2, 2]
    along = x * ax + y * ay + az
    depth = (centre[0] * ax + centre[1] * ay + centre[2] * az) / along
    qx, qy, qz = depth * x - centre[0], depth * y - centre[1], depth - centre[2]
    u = (qx * rotation[0, 0] + qy * rotation[1, 0] + qz * rotation[2, 0]) / radius
    v = (qx * rotation[0, 1] + qy * rotation[1, 1] + qz * rotation[2, 1]) / radius
    away = np.hypot(u, v)
    if away <= 1.0:
        _paint(seen, u, v, away, inks, lit, blood, glare)
    if away <= 3.0:
        _cover(seen, u, v, lit, fingers)
    # The shaft: a cylinder from the wheel towards the tip.
    px, py, pz = x - along * ax, y - along * ay, 1.0 - along * az
    before = centre[0] * ax + centre[1] * ay + centre[2] * az
    fx, fy, fz = centre[0] - before * ax, centre[1] - before * ay, centre[2] - before * az
    squared, mixed = px * px + py * py + pz * pz, px * fx + py * fy + pz * fz
    inner = mixed * mixed - squared * (fx * fx + fy * fy + fz * fz - shaft_radius**2)
    if inner > 0.0:
        hit = (mixed - np.sqrt(inner)) / squared
        if 0.0 < hit < depth:
            facing = abs((hit * px - fx) * px + (hit * py - fy) * py + (hit * pz - fz) * pz)
            facing /= shaft_radius * np.sqrt(squared)
            steel = 0.12 + 0.45 * facing**2 + 0.35 * facing**24
            for channel in range(3):
                seen[channel] = steel * lit[channel]


@compiled
def _paint(
    seen: FloatArray,
    u: float,
    v: float,
    away: float,
    inks: FloatArray,
    lit: FloatArray,
    blood: FloatArray,
    glare: FloatArray,
) -> None:
    """Light from a place of the wheel's face, in wheel radii."""
    if away > _WHITE_TO:
        seen[:] = _BLACK
    elif away > _INK_TO or _HOLE <= away < _INK_FROM:
        seen[:] = _WHITE
    elif away < _HOLE:
        seen[:] = _HUB
    else:
        turn = np.arctan2(v, u) / (2.0 * np.pi) % 1.0
        sector = min(int(turn * len(inks)), len(inks) - 1)
        for channel in range(3):
            seen[channel] = inks[sector, channel]
    for n in range(len(blood)):
        if np.hypot(u - blood[n, 0], v - blood[n, 1]) < blood[n, 2]:
            for channel in range(3):
                there = _BLOOD_RED if channel == 0 else _BLOOD_ELSE
                seen[channel] += blood[n, 3] * (there - seen[channel])
    for channel in range(3):
        seen[channel] *= lit[channel] * (1.0 + u * lit[3] + v * lit[4])
    for n in range(len(glare)):
        beyond = np.hypot(u - glare[n, 0], v - glare[n, 1]) / glare[n, 2]
        seen += glare[n, 3] * np.exp(-0.5 * beyond**2)


@compiled
def _cover(seen: FloatArray, u: float, v: float, lit: FloatArray, fingers: FloatArray) -> None:
    """A finger is a round bar that comes from outside and ends in half a disc."""
    for n in range(len(fingers)):
        towards_x, towards_y, half = fingers[n, 0], fingers[n, 1], fingers[n, 3]
        along = u * towards_x + v * towards_y - fingers[n, 2] - half
        beside = np.hypot(min(along, 0.0), u * towards_y - v * towards_x) / half
        if beside < 1.0:
            for channel in range(3):
                seen[channel] = fingers[n, 4 + channel] * lit[channel] * np.sqrt(1.0 - 0.7 * beside**2)
