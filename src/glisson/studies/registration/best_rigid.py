"""Two rigid registrations that know the truth: no rigid technique can be expected to do better.

They say how hard the cases are. `of_targets` is the rigid motion that fits the targets best; `of_data` is what closest
points (Besl and McKay 1992), features to features, come to on what was seen, started at that motion.
"""

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from glisson.core.arrays import FloatArray
from glisson.core.transform import RigidTransform
from glisson.geometry.distance import SurfaceTree
from glisson.phantom.sparse_data.case import SparseCase
from glisson.phantom.sparse_data.liver import SparseLiver
from glisson.phantom.sparse_data.swabbing import evenly_along

_ROUNDS = 100
_STILL_MM = 1e-3
_DOUBT_MM = 8.0
"""Residuals beyond so much count ever less (Geman and McClure 1987), so that wrong points hardly do."""

_CURVE_STEP_MM = 0.1


def of_targets(case: SparseCase) -> RigidTransform:
    """room_from_patient that fits the true targets best (Kabsch 1976)."""
    return _fitted(case.targets_mm, case.true_targets_mm, np.ones(len(case.targets_mm)))


def of_data(case: SparseCase, liver: SparseLiver) -> RigidTransform:
    """room_from_patient that brings the scanned surface, without any error of its own, closest to what was seen."""
    items = case.observations.items
    surface = SurfaceTree(liver.surface.vertices, liver.surface.triangles)
    curves = {name: evenly_along(curve, _CURVE_STEP_MM) for name, curve in liver.features.items()}
    trees = {name: cKDTree(points) for name, points in curves.items()}
    seen, found = np.vstack([item.points_mm for item in items]), of_targets(case)
    for _ in range(_ROUNDS):
        patient_from_room = found.inverse()
        parts = []
        for item in items:
            back = patient_from_room.apply(item.points_mm)
            if item.name in curves:
                parts.append(curves[item.name][trees[item.name].query(back)[1]])
            else:
                parts.append(surface.nearest(back).closest_mm)
        closest = np.vstack(parts)
        away = np.linalg.norm(found.apply(closest) - seen, axis=1)
        better = _fitted(closest, seen, 1.0 / (1.0 + (away / _DOUBT_MM) ** 2) ** 2)
        moved = np.abs(better.apply(closest) - found.apply(closest)).max()
        found = better
        if moved < _STILL_MM:
            break
    return found


def _fitted(patient: FloatArray, room: FloatArray, weights: FloatArray) -> RigidTransform:
    middle, centre = (np.average(points, axis=0, weights=weights) for points in (patient, room))
    turn, _ = Rotation.align_vectors(room - centre, patient - middle, weights=weights)
    matrix = turn.as_matrix()
    return RigidTransform("room", "patient", matrix, centre - matrix @ middle)
