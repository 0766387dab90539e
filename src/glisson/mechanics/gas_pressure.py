"""Pneumoperitoneum: the pressure of a gas on the organ's whole surface, which follows it."""

from itertools import permutations

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.mechanics.faces import exact_rule, face_nodes, face_slopes, face_values
from glisson.mechanics.parts import Memoryless

_ORDERS = tuple(permutations(range(3)))
_SIGNS = (1.0, -1.0, -1.0, 1.0, 1.0, -1.0)
"""Even and odd orders of three things."""


class GasPressure(Memoryless):
    """A `Part` with the potential p V: the surface is closed, so that the force has one, and a symmetric derivative.

    V = Σ A_abc x_a · (x_b × x_c) over the nodes a, b, c of each face, with constants A that change their sign
    when two of them change places.
    """

    def __init__(self, mesh: TetMesh) -> None:
        self.pressure_kpa = 0.0
        self._faces = face_nodes(mesh)
        self._constants = _constants(mesh.is_quadratic)
        self._centre = mesh.nodes.mean(axis=0)  # volumes are counted from it, which loses fewer digits

    def energy(self, positions: FloatArray) -> float:
        """P V in µJ."""
        if self.pressure_kpa == 0.0:
            return 0.0
        places = positions[self._faces] - self._centre
        return self.pressure_kpa * float(np.einsum("fai,fai->", places, self._slopes(places)) / 3.0)

    def forces(self, positions: FloatArray) -> FloatArray:
        """−p ∂V/∂x, (n, 3) in mN."""
        return self.forces_at(positions, self.pressure_kpa)

    def forces_at(self, positions: FloatArray, pressure_kpa: float) -> FloatArray:
        """The forces (n, 3) in mN of some pressure."""
        forces = np.zeros_like(positions)
        if pressure_kpa != 0.0:
            slopes = self._slopes(positions[self._faces] - self._centre)
            np.add.at(forces, self._faces, -pressure_kpa * slopes)
        return forces

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """P ∂²V/∂x²; left out where the stiffness must be definite, which it is not."""
        if project or self.pressure_kpa == 0.0:
            return self._faces[:0], np.zeros((0, *2 * self._faces.shape[1:], 3, 3))
        places = positions[self._faces] - self._centre
        arms = 6.0 * self.pressure_kpa * np.einsum("abc,fci->fabi", self._constants, places)
        local = np.zeros((*arms.shape, 3))
        # ∂(x_b × x_c)/∂x_b is −[x_c]×, the matrix of the product with x_c.
        for (i, j, k), sign in zip(_ORDERS, _SIGNS, strict=True):
            local[..., i, j] += sign * arms[..., k]
        return self._faces, local

    def _slopes(self, places: FloatArray) -> FloatArray:
        """∂V/∂x_a of each face's nodes (f, a, 3)."""
        crossed = np.cross(places[:, :, None, :], places[:, None, :, :])
        slopes: FloatArray = 3.0 * np.einsum("abc,fbci->fai", self._constants, crossed)
        return slopes


def _constants(quadratic: bool) -> FloatArray:
    """A (a, a, a): a third of ∫ N_a ∂N_b/∂ξ ∂N_c/∂η, made to change its sign with every exchange."""
    points, weights = exact_rule()
    values, slopes = face_values(points, quadratic), face_slopes(points, quadratic)
    plain = np.einsum("q,qa,qb,qc->abc", 0.5 * weights, values, slopes[:, :, 0], slopes[:, :, 1]) / 3.0
    whole: FloatArray = sum(sign / 6.0 * plain.transpose(order) for order, sign in zip(_ORDERS, _SIGNS, strict=True))
    return whole
