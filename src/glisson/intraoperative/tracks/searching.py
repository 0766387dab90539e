"""Where a marker that was lost should be, and whether it is thereabouts."""

import cv2
import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray
from glisson.intraoperative.tracks.patches import RADIUS_PX

_OTHER = 0.92
"""A second place that is as good as this, of the best one's correlation, makes the find uncertain."""


def expected_places(
    first: FloatArray, now: FloatArray, followed: NDArray[np.bool_], lost: NDArray[np.int64]
) -> tuple[FloatArray, FloatArray]:
    """Places (k, 2) and warps (k, 2, 2) of lost markers by those that are followed.

    With four or more of these an affine map of all, with fewer their mean shift, without any the place last known.

    Args:
        first: (m, 2) all markers in the first frame.
        now: (m, 2) in this frame; of lost ones where they were last.
        followed: (m,) whether a marker is followed in this frame.
        lost: (k,) those that are wanted.
    """
    warps = np.zeros((len(lost), 2, 2))
    count = int(followed.sum())
    if count == 0:
        return now[lost].copy(), warps
    if count < 4:
        return first[lost] + (now[followed] - first[followed]).mean(axis=0), warps
    flat = np.column_stack([first[followed], np.ones(count)])
    affine = np.linalg.lstsq(flat, now[followed], rcond=None)[0]
    warps[:] = RADIUS_PX * (affine[:2].T - np.eye(2))
    return np.column_stack([first[lost], np.ones(len(lost))]) @ affine, warps


def search(
    grey: NDArray[np.uint8], template: NDArray[np.float32], guess: FloatArray, reach_px: float, likeness: float
) -> FloatArray | None:
    """Where (2,) within reach of a guess a template (side, side) is found by normalised correlation.

    None where it is found nowhere, or at two places that look alike.
    """
    half = template.shape[0] // 2
    rows, columns = grey.shape
    low = np.maximum(np.floor(guess - reach_px).astype(int) - half, 0)
    high = np.minimum(np.ceil(guess + reach_px).astype(int) + half + 1, [columns, rows])
    if (high - low < template.shape[0]).any():
        return None
    part = grey[low[1] : high[1], low[0] : high[0]].astype(np.float32)
    scores = cv2.matchTemplate(part, template, cv2.TM_CCOEFF_NORMED)
    _, best, _, (u, v) = cv2.minMaxLoc(scores)
    if best < likeness:
        return None
    scores[max(v - half, 0) : v + half + 1, max(u - half, 0) : u + half + 1] = -1.0
    if scores.max() > _OTHER * best:
        return None
    return np.array([u + half + low[0], v + half + low[1]], dtype=np.float64)
