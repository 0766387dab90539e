"""Manufactured solutions: observed orders of convergence in finite deformation, against theory.

A displacement field u(X) is chosen; the body force that makes it the solution, b = −Div P(1 + ∇u), is found by
complex-step derivatives (Squire and Trapp 1998, SIAM Review 40:110) of a stress written down apart from the law
under test. Linear elements must converge with order 2 in L2 and 1 in H1, quadratic ones with 3 and 2.
"""

from functools import partial
from typing import Any

import numpy as np
from scipy.special import roots_jacobi

from glisson.core.arrays import FloatArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.geometry.boxes import box_mesh
from glisson.geometry.shape_functions import shape_slopes, shape_values
from glisson.verification.bodies import body_of, equilibrium, mapped
from glisson.verification.check import Case, Check, order_check

_SIDE = 10.0  # of the cube, mm
_STEP = 1e-30  # of the complex-step derivative, mm
_POINTS = 4  # of the fine quadrature in each direction, 64 in a tetrahedron
_COUNTS = {"T4": (7, 10, 14), "T10": (4, 6, 9)}
_ORDERS = {"T4": {"L2": 2.0, "H1": 1.0}, "T10": {"L2": 3.0, "H1": 2.0}}
_AMPLITUDES = np.array([0.6, -0.5, 0.7])  # mm
_WAVES = np.array([[0.7, 0.5, -0.4], [-0.3, 0.8, 0.6], [0.5, -0.6, 0.9]]) * np.pi / _SIDE
_PHASES = np.array([0.3, 1.1, -0.5])


def displacement(places: FloatArray) -> FloatArray:
    """The chosen displacements (n, 3) in mm."""
    result: FloatArray = _AMPLITUDES * np.sin(places @ _WAVES.T + _PHASES)
    return result


def gradient(places: Any) -> Any:
    """∂u/∂X (n, 3, 3) at real or complex places (n, 3)."""
    slopes = _AMPLITUDES * np.cos(places @ _WAVES.T + _PHASES)
    return slopes[:, :, None] * _WAVES


def body_force(places: FloatArray, material: Material) -> FloatArray:
    """−Div P (n, 3) in kPa/mm at places (n, 3)."""
    force = np.zeros(places.shape)
    for axis in range(3):
        shifted = places + 1j * _STEP * np.eye(3)[axis]
        force -= _stress(np.eye(3) + gradient(shifted), material)[:, :, axis].imag / _STEP
    return force


def _stress(gradients: Any, material: Material) -> Any:
    """P of the split neo-Hookean law for complex F (n, 3, 3)."""
    jacobians = np.linalg.det(gradients)[:, None, None]
    inverse = np.linalg.inv(gradients).transpose(0, 2, 1)
    first = np.sum(gradients * gradients, axis=(1, 2))[:, None, None]
    deviatoric = material.shear_modulus_kpa * jacobians ** (-2.0 / 3.0) * (gradients - first / 3.0 * inverse)
    return deviatoric + material.bulk_modulus_kpa * (jacobians - 1.0) * jacobians * inverse


def _rule() -> tuple[FloatArray, FloatArray]:
    """Barycentric points (q, 4) and weights summing to 1: Gauss and Jacobi points on collapsed coordinates."""
    lines = [roots_jacobi(_POINTS, power, 0.0) for power in (2.0, 1.0, 0.0)]
    a, b, c = np.meshgrid(*[0.5 * (1.0 + points) for points, _ in lines], indexing="ij")
    weights = np.einsum("i,j,k->ijk", *[weight / weight.sum() for _, weight in lines])
    first, second = a, (1.0 - a) * b
    third = (1.0 - a) * (1.0 - b) * c
    points = np.stack([1.0 - first - second - third, first, second, third], axis=-1)
    return points.reshape(-1, 4), weights.ravel()


class _FineRule:
    """Shape functions and places of a mesh at points fine enough to integrate what is not polynomial."""

    def __init__(self, mesh: TetMesh) -> None:
        points, weights = _rule()
        self.mesh = mesh
        self.shapes = shape_values(points, mesh.is_quadratic)
        slopes = shape_slopes(points, mesh.is_quadratic)
        self._derivatives = slopes[:, :, 1:] - slopes[:, :, :1]
        corners = mesh.nodes[mesh.corners]
        self._inverse = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
        self.weights = mesh.corner_volumes_mm3[:, None] * weights
        self.places = self.values(mesh.nodes)

    def values(self, nodal: FloatArray) -> FloatArray:
        """A nodal field (n, 3) at the points (m q, 3)."""
        places: FloatArray = np.einsum("qa,mai->mqi", self.shapes, nodal[self.mesh.tetrahedra]).reshape(-1, 3)
        return places

    def gradients(self, nodal: FloatArray) -> FloatArray:
        """Its gradient (m q, 3, 3)."""
        by_coordinate = np.einsum("qak,mai->mqik", self._derivatives, nodal[self.mesh.tetrahedra])
        slopes: FloatArray = (by_coordinate @ self._inverse[:, None]).reshape(-1, 3, 3)
        return slopes

    def loads(self, forces: FloatArray) -> FloatArray:
        """∫ N_a f dV as (n, 3), for forces (m q, 3) at the points."""
        weighted = self.weights[:, :, None] * forces.reshape(*self.weights.shape, 3)
        parts = np.einsum("mqi,qa->mai", weighted, self.shapes).reshape(-1, 3)
        flat, count = self.mesh.tetrahedra.ravel(), len(self.mesh.nodes)
        return np.stack([np.bincount(flat, parts[:, axis], count) for axis in range(3)], axis=1)

    def norm(self, field: FloatArray) -> float:
        """√∫ |f|² dV of a field (m q, …)."""
        return float(np.sqrt(self.weights.ravel() @ np.sum(field.reshape(self.weights.size, -1) ** 2, axis=1)))


def _skewed(places: FloatArray) -> FloatArray:
    """A smooth map of the cube onto itself, so that no symmetry of the mesh makes errors cancel."""
    x, y, z = (places / _SIDE).T
    bump = 0.06 * np.sin(np.pi * x) * np.sin(np.pi * y) * np.sin(np.pi * z)
    return places + _SIDE * np.stack([bump, -0.8 * bump, 0.6 * bump], axis=1)


def _errors(count: int, quadratic: bool) -> dict[str, float]:
    """Relative errors in the L2 norm and the H1 seminorm on a mesh of `count` cubes to a side."""
    material = Material("neo-hookean", 7.0, 0.3)
    mesh = mapped(box_mesh((_SIDE, _SIDE, _SIDE), (count, count, count)), _skewed)
    mesh = mesh.as_quadratic() if quadratic else mesh
    fine = _FineRule(mesh)
    outside = (np.abs(mesh.nodes / _SIDE - 0.5) > 0.5 - 1e-9).any(axis=1, keepdims=True)
    body = body_of(mesh, material, np.repeat(outside, 3, axis=1))
    body.external = fine.loads(body_force(fine.places, material))
    found = equilibrium(body, mesh.nodes + displacement(mesh.nodes), 1e-10) - mesh.nodes
    true, true_gradient = displacement(fine.places), gradient(fine.places)
    return {
        "L2": fine.norm(fine.values(found) - true) / fine.norm(true),
        "H1": fine.norm(fine.gradients(found) - true_gradient) / fine.norm(true_gradient),
    }


def _orders(name: str, element: str) -> list[Check]:
    counts = _COUNTS[element]
    errors = [_errors(count, element == "T10") for count in counts]
    sizes = [_SIDE / count for count in counts]
    return [
        order_check(f"{name}/{norm}", sizes, [error[norm] for error in errors], order, "theory of finite elements")
        for norm, order in _ORDERS[element].items()
    ]


CASES = tuple(
    Case(name, f"chosen finite deformation of a cube, neo-Hookean, {kind}", partial(_orders, name, kind), slow=True)
    for kind in _COUNTS
    for name in [f"mms/{kind}"]
)
