"""What hangs together with a place by its own grey values: a tumour, or a piece of the organ that is missing."""

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.preoperative.imaging.surroundings import Index, distance_from, surroundings
from glisson.preoperative.liver.intensity_prior import SOFT_TISSUE_HU, IntensityPrior
from glisson.preoperative.liver.reachable import reachable_region

_LOOK_MM = 5.0
"""The grey value of a place is that of the tissue so near."""

_DETAIL_MM = 3.0
"""Radius below which what hangs on a piece is left out."""


def like_piece(
    smooth: NDArray[np.float32],
    free: NDArray[np.bool_],
    spacing_mm: FloatArray,
    place: Index,
    reach_mm: float,
) -> NDArray[np.bool_]:
    """The piece about a place as far as its grey values go on, and its passages are wide; may be empty.

    Args:
        smooth: smoothed grey values (a, b, c).
        free: where the piece may be, same shape.
        spacing_mm: voxel spacing (3,).
        place: a free voxel.
        reach_mm: how far from the place the piece may go.
    """
    box, centre = surroundings(smooth.shape, spacing_mm, place, reach_mm)
    values = smooth[box]
    away = distance_from(centre, values.shape, spacing_mm)
    allowed = free[box] & (away <= reach_mm)
    near = values[allowed & (away <= _LOOK_MM)]
    level = float(np.median(near))
    prior = IntensityPrior(level, 1.4826 * float(np.median(np.abs(near - level))))
    # Reached is only what is soft tissue, so all else is made something else.
    alone = np.where(allowed, values, np.float32(SOFT_TISSUE_HU[0] - 1e3))
    reached = reachable_region(alone, prior, spacing_mm, [centre], _DETAIL_MM) & allowed
    parts, _ = ndimage.label(reached)
    piece = np.zeros(smooth.shape, dtype=bool)
    if parts[centre]:
        piece[box] = parts == parts[centre]
    return piece
