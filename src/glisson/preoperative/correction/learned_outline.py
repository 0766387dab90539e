"""What the drawn slices teach about the others: a classifier of this one scan's voxels near the outline.

Blending shapes knows nothing of the picture. In the drawn slices a person has said of each pixel what it is; boosted
trees (Friedman 2001, Annals of Statistics 29:1189) learn it from the grey values about the pixel, its place, and its
distance from the automatic and the blended outline, and say it of the slices between. In a drawn slice the blended
outline is the one that the other drawn slices give, so that what is learned is what a slice that nobody drew needs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from glisson.core.arrays import FloatArray
from glisson.core.image import Volume
from glisson.core.protocols import Progress, silent
from glisson.preoperative.contours.signed_distance import signed_distance_of_mask
from glisson.preoperative.correction.shape_blending import Correction, blended_slice, neighbours
from glisson.preoperative.imaging.components import largest_part
from glisson.preoperative.imaging.diffusion import smoothed
from glisson.preoperative.imaging.working_grid import WorkingGrid

FEWEST_SLICES = 3
"""Fewer drawn slices teach too little."""

_RESOLUTION_MM = 1.5
_LEARNED_MM, _CHANGED_MM = 20.0, 15.0
"""What is so near to the blended outline is learned from, and may change."""

_FARTHEST_MM = 30.0
_CALM_MM = 1.2
"""Standard deviation of the Gaussian that takes the noise out of the probabilities."""

_MARGIN_MM = 30.0
_RANGE = (0.5, 99.5)
"""Percentiles of the grey values about the organ to which they are cut."""


def learned_outline(
    volume: Volume,
    automatic: NDArray[np.bool_],
    drawn: NDArray[np.bool_],
    numbers: Sequence[int],
    progress: Progress = silent,
) -> NDArray[np.bool_]:
    """The mask [i, j, k] whose slices follow the drawn ones; these are as they were drawn.

    Args:
        volume: the CT or MR.
        automatic: the mask before, on the scan's grid, not empty.
        drawn: a mask that is right in some slices.
        numbers: the numbers of these slices along the slice axis, at least `FEWEST_SLICES`.
        progress: told how far it is.
    """
    grid = _in_plane_grid(volume)
    whole = np.transpose(automatic | drawn, grid.order)
    low, high = _bounds(whole, grid)
    part, place = grid.part(low, high)
    before, target = (part.working(mask[place]) >= 0.5 for mask in (automatic, drawn))
    progress(0.1, "features of the scan")
    features = _features(part.working(volume.voxels[place]), before, part.spacing_mm)
    own = [number - low[2] for number in numbers]
    progress(0.4, "blending")
    blended = _blended(before, target, own, part.spacing_mm)
    progress(0.6, "learning from the drawn slices")
    inside = _classified(features, before, target, own, blended, part.spacing_mm)
    result = np.zeros_like(automatic)
    result[place] = ndimage.binary_fill_holes(largest_part(part.full(inside)))
    for number in numbers:
        slices = (slice(None),) * grid.order[2] + (number,)
        result[slices] = drawn[slices]
    return result


def _in_plane_grid(volume: Volume) -> WorkingGrid:
    """The working grid with all of the scan's slices."""
    grid = WorkingGrid.of(volume.grid, _RESOLUTION_MM)
    a, b, c = grid.factors
    return replace(grid, factors=(a, b, 1), spacing_mm=grid.spacing_mm / [1.0, 1.0, c])


def _bounds(mask: NDArray[np.bool_], grid: WorkingGrid) -> tuple[list[int], list[int]]:
    """Working voxels from and to which all is looked at: the mask's rows and columns with a margin, and all slices."""
    found = ndimage.find_objects(mask.astype(np.uint8))[0]
    low, high = [], []
    for axis in range(2):
        margin, factor = int(np.ceil(_MARGIN_MM / grid.spacing_mm[axis])), grid.factors[axis]
        low.append(max(found[axis].start // factor - margin, 0))
        high.append(min(-(-found[axis].stop // factor) + margin, -(-mask.shape[axis] // factor)))
    return [*low, 0], [*high, mask.shape[2]]


def _features(
    values: NDArray[np.float32], before: NDArray[np.bool_], spacing_mm: FloatArray
) -> list[NDArray[np.float32]]:
    """Grey values about each voxel at some scales, how much they vary, its place and distance from the outline."""
    cut = np.clip(values, *np.percentile(values, _RANGE))
    means = [ndimage.gaussian_filter(cut, scale / spacing_mm) for scale in (2.0, 3.0, 5.0)]
    variance = ndimage.gaussian_filter(cut * cut, 3.0 / spacing_mm) - means[1] ** 2
    steepness = ndimage.gaussian_gradient_magnitude(cut, 2.0 / spacing_mm)
    places = [
        np.broadcast_to(np.arange(n, dtype=np.float32).reshape([-1 if a == b else 1 for b in range(3)]), cut.shape)
        for a, n in enumerate(cut.shape)
    ]
    calm, spread = smoothed(cut, spacing_mm), np.sqrt(np.maximum(variance, 0.0))
    return [calm, means[0], means[2], spread, steepness, *places, _distance(before, spacing_mm)]


def _blended(
    before: NDArray[np.bool_], target: NDArray[np.bool_], numbers: list[int], spacing_mm: FloatArray
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Distance from the blended outline; and in the drawn slices from what the other drawn slices give."""
    drawn = {n: Correction.of(n, before[:, :, n], target[:, :, n], spacing_mm[:2]) for n in numbers}
    every = _between(before, drawn, range(before.shape[2]), spacing_mm)
    every[:, :, numbers] = target[:, :, numbers]
    distance = _distance(every, spacing_mm)
    others = distance.copy()
    for n in numbers:
        rest = {number: correction for number, correction in drawn.items() if number != n}
        # Its neighbours must not know it either, since distances reach from slice to slice.
        first = max((k for k in rest if k < n), default=-1) + 1
        last = min((k for k in rest if k > n), default=before.shape[2])
        low = max(first - 1, 0)
        part = every[:, :, low : last + 1].copy()
        part[:, :, first - low : last - low] = _between(before, rest, range(first, last), spacing_mm)
        others[:, :, n] = _distance(part, spacing_mm)[:, :, n - low]
    return distance, others


def _between(
    before: NDArray[np.bool_], drawn: Mapping[int, Correction], numbers: range, spacing_mm: FloatArray
) -> NDArray[np.bool_]:
    """The slices of these numbers as drawn ones make them."""
    return np.stack([blended_slice(before[:, :, n], n, neighbours(drawn, n), spacing_mm) for n in numbers], axis=2)


def _classified(
    features: list[NDArray[np.float32]],
    before: NDArray[np.bool_],
    target: NDArray[np.bool_],
    numbers: list[int],
    blended: tuple[NDArray[np.float32], NDArray[np.float32]],
    spacing_mm: FloatArray,
) -> NDArray[np.bool_]:
    from sklearn.ensemble import HistGradientBoostingClassifier  # slow to load, and `--help` needs this module

    every, others = blended
    rows, right = [], []
    for k in numbers:
        near = np.abs(others[:, :, k]) < _LEARNED_MM
        rows.append(np.stack([*(feature[:, :, k][near] for feature in features), others[:, :, k][near]], axis=1))
        right.append(target[:, :, k][near])
    learned = np.concatenate(right)
    inside: NDArray[np.bool_] = every < 0.0
    if learned.all() or not learned.any():
        return inside
    trees = HistGradientBoostingClassifier(
        max_iter=100, learning_rate=0.08, max_leaf_nodes=15, min_samples_leaf=60, l2_regularization=1.0,
        early_stopping=False, random_state=0,
    )  # fmt: skip
    trees.fit(np.concatenate(rows), learned)
    near = np.abs(every) < _CHANGED_MM
    share = inside.astype(np.float32)
    share[near] = trees.predict_proba(np.stack([*(feature[near] for feature in features), every[near]], axis=1))[:, 1]
    return np.asarray(ndimage.gaussian_filter(share, _CALM_MM / spacing_mm) > 0.5)


def _distance(mask: NDArray[np.bool_], spacing_mm: FloatArray) -> NDArray[np.float32]:
    distance = signed_distance_of_mask(mask, spacing_mm)
    return np.clip(distance, -_FARTHEST_MM, _FARTHEST_MM).astype(np.float32)
