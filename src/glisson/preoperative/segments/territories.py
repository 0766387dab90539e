"""Territories of labelled centrelines: every voxel of an organ belongs to the nearest point.

The same as asking every voxel for its nearest point, but blocks of voxels whose candidates all carry one label are
filled at once: a point can be the nearest of a voxel in a block only when it lies no farther from the block's centre
than that centre's own nearest point and the block's diagonal.
"""

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.image import Grid

_BLOCK = 8  # voxels along each axis


def nearest_labels(
    mask: NDArray[np.bool_], grid: Grid, points_mm: FloatArray, labels: NDArray[np.integer]
) -> NDArray[np.uint8]:
    """Label of the nearest point for every voxel of a mask [i, j, k], 0 outside of it.

    Args:
        mask: the organ.
        grid: where its voxels lie.
        points_mm: points (n, 3), LPS mm; close together along the lines that they stand for.
        labels: of the points (n,), 1 to 255.

    Raises:
        BadInput: there is no point, or a label is out of range.
    """
    points, numbers = np.asarray(points_mm, dtype=np.float64), np.asarray(labels)
    if len(points) == 0 or len(numbers) != len(points):
        raise BadInput(f"Territories need points with a label each, not {len(points)} with {len(numbers)} labels.")
    if numbers.min() < 1 or numbers.max() > np.iinfo(np.uint8).max:
        raise BadInput(f"Labels of territories must be 1 to 255, not {int(numbers.min())} to {int(numbers.max())}.")
    numbers = numbers.astype(np.uint8)
    found = np.zeros(mask.shape, dtype=np.uint8)
    if not mask.any():
        return found
    corners = _blocks_with(mask)
    starts, candidates = _candidates(corners, grid, points)
    affine = grid.lps_from_index
    _fill(mask, corners, starts, candidates, points, numbers, affine[:3, :3].copy(), affine[:3, 3].copy(), found)
    return found


def _blocks_with(mask: NDArray[np.bool_]) -> IntArray:
    """First voxel (b, 3) of every block that holds part of the mask."""
    padded = np.pad(mask, [(0, -n % _BLOCK) for n in mask.shape])
    i, j, k = (n // _BLOCK for n in padded.shape)
    holds = padded.reshape(i, _BLOCK, j, _BLOCK, k, _BLOCK).any(axis=(1, 3, 5))
    corners: IntArray = _BLOCK * np.argwhere(holds)
    return corners


def _candidates(corners: IntArray, grid: Grid, points: FloatArray) -> tuple[IntArray, IntArray]:
    """Numbers (c,) of the points that can be nearest in each block, and where each block's begin (b + 1,)."""
    centres = grid.points_from_indices(corners + 0.5 * (_BLOCK - 1))
    diagonal = (_BLOCK - 1) * float(np.linalg.norm(grid.spacing_mm))
    tree = cKDTree(points)
    nearest, _ = tree.query(centres, workers=-1)
    found = tree.query_ball_point(centres, (nearest + diagonal) * (1.0 + 1e-9), workers=-1)
    starts = np.concatenate([[0], np.cumsum([len(numbers) for numbers in found])]).astype(np.int64)
    return starts, np.concatenate([np.asarray(numbers, dtype=np.int64) for numbers in found])


@njit(parallel=True, cache=True)
def _fill(
    mask: NDArray[np.bool_],
    corners: IntArray,
    starts: IntArray,
    candidates: IntArray,
    points: FloatArray,
    labels: NDArray[np.uint8],
    axes: FloatArray,
    origin: FloatArray,
    found: NDArray[np.uint8],
) -> None:  # pragma: no cover - compiled
    for block in prange(len(corners)):
        own = candidates[starts[block] : starts[block + 1]]
        first = labels[own[0]]
        alike = True
        for number in own:
            alike = alike and labels[number] == first
        low = corners[block]
        for i in range(low[0], min(low[0] + _BLOCK, mask.shape[0])):
            for j in range(low[1], min(low[1] + _BLOCK, mask.shape[1])):
                for k in range(low[2], min(low[2] + _BLOCK, mask.shape[2])):
                    if not mask[i, j, k]:
                        continue
                    if alike:
                        found[i, j, k] = first
                        continue
                    x = axes[0, 0] * i + axes[0, 1] * j + axes[0, 2] * k + origin[0]
                    y = axes[1, 0] * i + axes[1, 1] * j + axes[1, 2] * k + origin[1]
                    z = axes[2, 0] * i + axes[2, 1] * j + axes[2, 2] * k + origin[2]
                    least, label = np.inf, first
                    for number in own:
                        dx, dy, dz = points[number, 0] - x, points[number, 1] - y, points[number, 2] - z
                        apart = dx * dx + dy * dy + dz * dz
                        if apart < least:
                            least, label = apart, labels[number]
                    found[i, j, k] = label
