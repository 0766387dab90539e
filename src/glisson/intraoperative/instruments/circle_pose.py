"""The two poses of a circle that is seen as an ellipse (Chen, Wu and Wada 2004)."""

import numpy as np

from glisson.core.arrays import FloatArray


def conic_through(points: FloatArray) -> FloatArray:
    """The conic (3, 3) nearest to points (n, 2), n ≥ 5: (x, y, 1) C (x, y, 1)ᵀ = 0, by singular values."""
    middle, scale = points.mean(axis=0), float(points.std()) or 1.0
    x, y = ((points - middle) / scale).T
    rows = np.stack([x * x, x * y, y * y, x, y, np.ones_like(x)], axis=1)
    a, b, c, d, e, f = np.linalg.svd(rows, full_matrices=False)[2][-1]
    conic = np.array([[a, b / 2, d / 2], [b / 2, c, e / 2], [d / 2, e / 2, f]])
    back = np.array([[1.0, 0.0, -middle[0]], [0.0, 1.0, -middle[1]], [0.0, 0.0, scale]]) / scale
    moved: FloatArray = back.T @ conic @ back
    return moved


def circle_poses(conic: FloatArray, radius_mm: float) -> list[tuple[FloatArray, FloatArray]]:
    """Centre (3,) in mm and unit normal (3,) towards the camera of both circles of a radius behind a conic.

    Args:
        conic: (3, 3) of the slopes x / z, y / z.
        radius_mm: of the circle.

    Returns:
        Two poses, or none where the conic is no ellipse.
    """
    values, vectors = np.linalg.eigh(0.5 * (conic + conic.T))
    if np.sum(values > 0.0) == 1:
        values, vectors = -values[::-1], vectors[:, ::-1]
    values, vectors = values[::-1], vectors[:, ::-1]
    first, second, third = values
    if not (second > 0.0 > third):
        return []
    sine, cosine = np.sqrt((first - second) / (first - third)), np.sqrt((second - third) / (first - third))
    away = second * radius_mm / np.sqrt(-first * third)
    found = []
    for side in (1.0, -1.0):
        normal = side * sine * vectors[:, 0] - cosine * vectors[:, 2]
        centre = away * (side * third / second * sine * vectors[:, 0] - first / second * cosine * vectors[:, 2])
        centre = centre if centre[2] > 0.0 else -centre
        found.append((centre, normal if normal @ centre < 0.0 else -normal))
    return found
