"""Validated, read-only numpy arrays: the building stones of the frozen types."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from glisson.core.errors import BadInput

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

_ROUNDED = 1e-3
"""Covariances may be rounded to three digits, of the standard deviations of what they are between."""


def frozen_floats(value: ArrayLike, shape: Sequence[int | None], what: str) -> FloatArray:
    """Copy `value` into a read-only float64 array of the given shape (None: any length).

    Raises:
        BadInput: the shape differs or a number is not finite; `what` names the array.
    """
    array = np.array(value, dtype=np.float64, order="C", copy=True)
    _check_shape(array, shape, what)
    if not np.isfinite(array).all():
        raise BadInput(f"{what} has {int((~np.isfinite(array)).sum())} values that are not finite.")
    array.setflags(write=False)
    return array


def frozen_ints(value: ArrayLike, shape: Sequence[int | None], what: str) -> IntArray:
    """Copy `value` into a read-only int64 array of the given shape (None: any length).

    Raises:
        BadInput: the shape differs, a number is not whole, or it is a mask.
    """
    raw = np.asarray(value)
    if raw.dtype.kind == "b":
        raise BadInput(f"{what} must hold numbers, not true and false; np.flatnonzero makes numbers of a mask.")
    array = np.array(raw, dtype=np.int64, order="C", copy=True)
    _check_shape(array, shape, what)
    if raw.dtype.kind == "f" and not np.array_equal(raw, array):
        raise BadInput(f"{what} must hold whole numbers.")
    array.setflags(write=False)
    return array


def unit_vector(value: ArrayLike, what: str) -> FloatArray:
    """Read-only unit vector, shape (3,), along `value`.

    Raises:
        BadInput: `value` is not a finite, non-zero 3-vector.
    """
    vector = frozen_floats(value, (3,), what)
    length = float(np.linalg.norm(vector))
    if length == 0.0:
        raise BadInput(f"{what} must not be the zero vector.")
    unit = vector / length
    unit.setflags(write=False)
    return unit


def frozen_covariance(
    value: ArrayLike, shape: Sequence[int | None], what: str, *, singular: bool = False
) -> FloatArray:
    """Like `frozen_floats` for covariances (..., k, k), which must be symmetric and positive definite.

    With `singular` they need be semi-definite only, as where something is known exactly.

    Raises:
        BadInput: the shape differs, or one of them is no covariance beyond rounding.
    """
    array = frozen_floats(value, shape, what)
    if not array.size:
        return array
    begun = f"{what[0].upper()}{what[1:]} must be"
    variances = np.diagonal(array, axis1=-2, axis2=-1)
    if (variances < 0.0).any():
        raise BadInput(f"{begun} a covariance, but has a negative variance.")
    largest = np.sqrt(variances[..., :, None] * variances[..., None, :])
    if (np.abs(array - np.swapaxes(array, -1, -2)) > _ROUNDED * largest).any():
        raise BadInput(f"{begun} symmetric.")
    if not singular and not (np.linalg.eigvalsh(array) > 0.0).all():
        raise BadInput(f"{begun} positive definite.")
    # Of the correlations, so that units (rad beside mm) do not matter.
    correlations = array / np.where(largest > 0.0, largest, 1.0)
    if (np.abs(array) > (1.0 + _ROUNDED) * largest).any() or (np.linalg.eigvalsh(correlations) < -_ROUNDED).any():
        raise BadInput(f"{begun} positive semi-definite.")
    return array


def check_range(indices: IntArray, count: int, what: str) -> None:
    """Raise BadInput when an index lies outside [0, count)."""
    if indices.size and (int(indices.min()) < 0 or int(indices.max()) >= count):
        raise BadInput(f"{what} points outside the {count} entries that exist.")


def _check_shape(array: NDArray[Any], shape: Sequence[int | None], what: str) -> None:
    fits = array.ndim == len(shape) and all(
        want is None or want == have for want, have in zip(shape, array.shape, strict=False)
    )
    if not fits:
        wanted = " × ".join("n" if n is None else str(n) for n in shape)
        raise BadInput(f"{what} must have shape {wanted}, not {' × '.join(map(str, array.shape))}.")
