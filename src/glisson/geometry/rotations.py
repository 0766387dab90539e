"""Rotations nearest to matrices."""

import numpy as np

from glisson.core.arrays import FloatArray


def nearest_rotation(matrix: FloatArray) -> FloatArray:
    """The rotations R (..., 3, 3) that make the traces of Rᵀ M greatest, of matrices M (..., 3, 3) (Kabsch 1976).

    With M = Σ w y xᵀ it is the rotation that brings points x nearest to points y.
    """
    left, _, right = np.linalg.svd(matrix)
    mirror = np.ones(matrix.shape[:-1])
    mirror[..., 2] = np.sign(np.linalg.det(left @ right))
    rotation: FloatArray = (left * mirror[..., None, :]) @ right
    return rotation
