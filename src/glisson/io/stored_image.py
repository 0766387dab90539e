"""What an image file holds before anybody says whether it is a scan or labels."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glisson.core import BadInput, Grid

_WHOLE_TYPES = (np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64)


@dataclass(frozen=True, eq=False)
class StoredImage:
    """Voxels [i, j, k] with rescaling applied, in LPS mm, and the label names and modality that the file states."""

    voxels: NDArray[Any]
    grid: Grid
    names: Mapping[int, str] = field(default_factory=dict)
    modality: str | None = None


def rescaled(stored: NDArray[Any], slope: float, intercept: float) -> NDArray[Any]:
    """Stored values times slope plus intercept, in the smallest type that keeps whole numbers whole.

    Raises:
        BadInput: slope or intercept is not finite, or the slope is 0.
    """
    if not (np.isfinite(slope) and np.isfinite(intercept)) or slope == 0.0:
        raise BadInput(f"its rescaling (slope {slope}, intercept {intercept}) is unusable.")
    if slope == 1.0 and intercept == 0.0:
        native: NDArray[Any] = stored.astype(stored.dtype.newbyteorder("="), copy=False)
        return native
    if stored.dtype.kind in "iu" and slope == int(slope) and intercept == int(intercept):
        low, high = int(stored.min()), int(stored.max())
        scaled = (low * int(slope), high * int(slope))
        # Every intermediate value must fit, not only the ends of the result.
        steps = (low, high, int(slope), int(intercept), *scaled, *(value + int(intercept) for value in scaled))
        kind = whole_type(min(steps), max(steps))
        whole: NDArray[Any] = stored.astype(kind) * kind.type(slope) + kind.type(intercept)
        return whole
    values: NDArray[Any] = stored.astype(np.float32) * np.float32(slope) + np.float32(intercept)
    return values


def in_c_order(voxels: NDArray[Any]) -> NDArray[Any]:
    """The same voxels [i, j, k] with k running fastest in memory, as compiled loops want them.

    Files store i fastest. Row by row this is four times as fast as numpy's own transposition.
    """
    if voxels.flags.c_contiguous:
        return voxels
    ordered = np.zeros(voxels.shape, dtype=voxels.dtype)
    for j in range(voxels.shape[1]):
        ordered[:, j] = voxels[:, j]
    return ordered


def whole_type(low: int, high: int) -> np.dtype[Any]:
    """Smallest of the common integer types that holds both ends.

    Raises:
        BadInput: not even 64 bits do.
    """
    for kind in _WHOLE_TYPES:
        limits = np.iinfo(kind)
        if limits.min <= low and high <= limits.max:
            return np.dtype(kind)
    raise BadInput(f"its values from {low} to {high} do not fit into 64 bits.")


def as_whole_numbers(voxels: NDArray[Any]) -> NDArray[Any]:
    """The same labels in the smallest unsigned (or signed) integer type.

    Raises:
        BadInput: a value is not a whole number, or negative.
    """
    if voxels.dtype.kind not in "iufb":
        raise BadInput(f"labels must be whole numbers, not {voxels.dtype}.")
    if voxels.dtype.kind == "f" and not (np.isfinite(voxels).all() and (voxels == np.rint(voxels)).all()):
        raise BadInput("it holds fractions, so it is no label map (a resampled one needs nearest-neighbour values).")
    low, high = (int(voxels.min()), int(voxels.max())) if voxels.size else (0, 0)
    if low < 0:
        raise BadInput(f"labels must not be negative, but it holds {low}.")
    numbers: NDArray[Any] = voxels.astype(whole_type(0, high), copy=False)
    return numbers
