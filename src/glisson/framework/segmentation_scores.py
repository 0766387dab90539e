"""How well a segmentation agrees with a reference: overlap, and distances between the surfaces.

Heimann et al., "Comparison and evaluation of methods for liver segmentation from CT datasets",
IEEE Transactions on Medical Imaging 28(8), 2009: a mask's surface voxels are those with a face neighbour
outside, and distances run between the centres of surface voxels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from skimage.morphology import skeletonize

from glisson.core.arrays import FloatArray
from glisson.core.errors import BadInput
from glisson.core.image import Grid
from glisson.geometry.distance_map import distance_inside


@dataclass(frozen=True)
class SegmentationScores:
    """Agreement of two masks.

    `dice` is 2 |A ∩ B| / (|A| + |B|); `asd_mm` the average symmetric surface distance, the mean over the
    surface voxels of both masks; `hd95_mm` the 95th percentile of the same distances.
    """

    dice: float
    asd_mm: float
    hd95_mm: float


def segmentation_scores(found: NDArray[np.bool_], reference: NDArray[np.bool_], grid: Grid) -> SegmentationScores:
    """Scores of a mask [i, j, k] against a reference on the same grid.

    Raises:
        BadInput: a mask is empty or has not the grid's shape.
    """
    for mask, what in ((found, "The segmentation"), (reference, "The reference mask")):
        if mask.shape != grid.shape:
            raise BadInput(f"{what} has shape {mask.shape}, but the scan {grid.shape}; resample it onto the scan.")
        if not mask.any():
            raise BadInput(f"{what} is empty, so there is nothing to compare.")
    either = found | reference
    box = ndimage.find_objects(either.astype(np.uint8))[0]
    a, b = found[box], reference[box]
    dice = 2.0 * float((a & b).sum()) / float(a.sum() + b.sum())
    distances = _surface_distances_mm(a, b, grid.spacing_mm)
    return SegmentationScores(dice, float(distances.mean()), float(np.percentile(distances, 95.0)))


def centreline_dice(found: NDArray[np.bool_], reference: NDArray[np.bool_]) -> float:
    """How much of each mask's skeleton lies in the other, harmonic mean (clDice; Shit et al., CVPR 2021).

    Raises:
        BadInput: a mask is empty.
    """
    if not found.any() or not reference.any():
        raise BadInput("A mask of vessels is empty, so there is nothing to compare.")
    box = ndimage.find_objects((found | reference).astype(np.uint8))[0]
    a, b = np.pad(found[box], 1), np.pad(reference[box], 1)
    skeleton_a, skeleton_b = skeletonize(a), skeletonize(b)
    precision = float((skeleton_a & b).sum()) / float(skeleton_a.sum())
    sensitivity = float((skeleton_b & a).sum()) / float(skeleton_b.sum())
    return 2.0 * precision * sensitivity / max(precision + sensitivity, 1e-12)


def _surface_distances_mm(a: NDArray[np.bool_], b: NDArray[np.bool_], spacing_mm: FloatArray) -> FloatArray:
    surface_a, surface_b = (mask & ~ndimage.binary_erosion(mask) for mask in (a, b))
    to_b, to_a = (distance_inside(~surface, spacing_mm) for surface in (surface_b, surface_a))
    return np.concatenate([to_b[surface_a], to_a[surface_b]])
