"""Which point of one course belongs to which of another, in the order along both."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import StageFailed
from glisson.core.status import Status

_MOST_MISS_PX = 10.0
_JUMP_PX2 = 0.05
"""Cost of a step along the second course: a path with fewer is preferred where nothing else tells."""


def matched_course(misses_px: FloatArray, second_px: FloatArray) -> tuple[FloatArray, FloatArray]:
    """For each point of the first course the point of the second (n, 2), and the second's unit tangent there (n, 2).

    The order along both is kept, so that a line that crosses the second course several times misleads nobody
    (dynamic programming; both ends are free).

    Args:
        misses_px: (n, m) how far point j of the second course is from the epipolar line of point i of the first.
        second_px: (m, 2).

    Raises:
        StageFailed: the courses do not belong together (ambiguous).
    """
    chosen = _cheapest_path(misses_px**2)
    miss = float(np.median(misses_px[np.arange(len(chosen)), chosen]))
    if miss > _MOST_MISS_PX:
        raise StageFailed(
            f"The two courses of the wire do not fit each other ({miss:.0f} px off the epipolar lines); check which is "
            "the mouth's end, and the projections' calibration.",
            Status.AMBIGUOUS,
        )
    tangents = np.gradient(second_px, axis=0)
    tangents = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    return second_px[chosen], tangents[chosen]


def _cheapest_path(costs: FloatArray) -> IntArray:
    """A column (n,) for each row, never falling, of least total cost."""
    rows, columns = costs.shape
    at = np.arange(columns)
    total, before = costs[0].copy(), np.zeros((rows, columns), dtype=np.int64)
    for row in range(1, rows):
        # The least of total[k] + jump · (j − k) over k ≤ j is a running minimum of total[k] − jump · k.
        shifted = total - _JUMP_PX2 * at
        least = np.minimum.accumulate(shifted)
        fresh = np.concatenate([[True], shifted[1:] < least[:-1]])
        before[row] = np.maximum.accumulate(np.where(fresh, at, 0))
        total = costs[row] + least + _JUMP_PX2 * at
    path = np.zeros(rows, dtype=np.int64)
    path[-1] = int(np.argmin(total))
    for row in range(rows - 1, 0, -1):
        path[row - 1] = before[row, path[row]]
    return path
