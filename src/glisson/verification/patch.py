"""Patch tests: an affine displacement of the boundary is reproduced inside, on a distorted mesh."""

from functools import partial

import numpy as np

from glisson.geometry.boxes import box_mesh
from glisson.verification.bodies import LAWS, body_of, distorted, equilibrium, material_of
from glisson.verification.check import Case, Check, vanishing

_SIZES = (30.0, 20.0, 10.0)
_GRADIENT = np.array([[0.05, 0.02, -0.03], [0.04, -0.06, 0.01], [0.02, 0.03, 0.04]])


def _patch(name: str, quadratic: bool, law: str) -> list[Check]:
    coarse = distorted(box_mesh(_SIZES, (3, 3, 3)), 1.0)
    mesh = coarse.as_quadratic() if quadratic else coarse
    outside = (np.abs(mesh.nodes / _SIZES - 0.5) > 0.5 - 1e-9).any(axis=1, keepdims=True)
    affine = mesh.nodes @ (np.eye(3) + _GRADIENT).T
    body = body_of(mesh, material_of(law), np.repeat(outside, 3, axis=1))
    start = np.where(outside, affine, mesh.nodes + 0.9 * (affine - mesh.nodes))
    end = equilibrium(body, start, tolerance=1e-13)
    error = np.abs(end - affine).max() / np.abs(affine - mesh.nodes).max()
    return [vanishing(f"{name}/displacement", error, 1e-9, "", "affine displacements lie in the space")]


CASES = tuple(
    Case(name, f"affine boundary displacement, {element}, {law}", partial(_patch, name, element == "T10", law))
    for element in ("T4", "T10")
    for law in LAWS
    for name in [f"patch/{element}/{law}"]
)
