"""A mask corrected by clicks: one into what is missing adds it, one into what is too much takes it away.

A click says what, not where it ends. A missing piece ends where its own grey values end, or where it is narrow
compared with itself, as in `liver.reachable`. A piece too much ends at its narrowest passage to the organ's
core: the mask's widths are flooded from both (watershed, Beucher and Lantuéjoul 1979), and where the floods
meet is the end. Nothing further from a click than its reach changes.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.segmentation import watershed

from glisson.core.arrays import FloatArray
from glisson.geometry.distance_map import distance_inside
from glisson.preoperative.imaging.surroundings import Index, distance_from, surroundings
from glisson.preoperative.liver.completion import without_gaps
from glisson.preoperative.liver.piece import like_piece

_REACH_MM = 50.0
"""How far from a click things may change."""

_TOUCH_MM = 3.0
"""What is so near to a click changes in any case."""

_RIM_MM = 4.0
"""Between a piece and the organ a rim is left whose grey values are neither's, up to twice as wide; it is filled."""

_CORE_SHARE = 0.7
"""Where the mask is this fraction as wide as at its widest it is the organ in any case."""


def with_piece(
    smooth: NDArray[np.float32], mask: NDArray[np.bool_], spacing_mm: FloatArray, click: Index
) -> NDArray[np.bool_]:
    """The mask with the piece that was clicked.

    Args:
        smooth: smoothed grey values (a, b, c).
        mask: the organ's mask so far, same shape.
        spacing_mm: voxel spacing (3,).
        click: the voxel clicked, outside the mask.
    """
    box, place = surroundings(mask.shape, spacing_mm, click, _REACH_MM)
    inside, values = mask[box], smooth[box]
    piece = like_piece(values, ~inside, spacing_mm, place, _REACH_MM)
    piece |= ~inside & (distance_from(place, inside.shape, spacing_mm) <= _TOUCH_MM)
    near = distance_inside(~piece, spacing_mm) <= 2.0 * _RIM_MM
    rim = without_gaps(inside | piece, values, spacing_mm, _RIM_MM) & near
    result = mask.copy()
    result[box] |= piece | rim
    return result


def without_piece(
    mask: NDArray[np.bool_], spacing_mm: FloatArray, click: Index, kept: Sequence[Index] = ()
) -> NDArray[np.bool_]:
    """The mask without the piece that was clicked.

    Args:
        mask: the organ's mask so far (a, b, c).
        spacing_mm: voxel spacing (3,).
        click: the voxel clicked, inside the mask.
        kept: voxels that belong to the organ in any case: where others have clicked.
    """
    width = distance_inside(mask, spacing_mm)
    core = width >= _CORE_SHARE * width.max()
    for index in kept:
        core[index] = True
    box, place = surroundings(mask.shape, spacing_mm, click, _REACH_MM)
    away = distance_from(place, width[box].shape, spacing_mm)
    markers = np.zeros(away.shape, dtype=np.int32)
    markers[core[box] | (away > _REACH_MM)] = 2
    markers[away <= _TOUCH_MM] = 1
    relief = -ndimage.gaussian_filter(width[box].astype(np.float32), 1.5 / spacing_mm)
    result = mask.copy()
    result[box] &= watershed(relief, markers, mask=mask[box]) != 1
    return result
