"""Elastic energy, internal forces and stiffness of the organ, assembled over its elements."""

from collections.abc import Mapping

import numpy as np
from numba import njit, prange

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.mechanics.elements import quadrature
from glisson.mechanics.materials.law import Law, find_law
from glisson.mechanics.pattern import BlockPattern

_CHUNK = 4096  # elements whose tangents and stiffness are held at once (about 40 MB for T10)


class Elasticity:
    """The elastic body.

    Args:
        mesh: the elements; T4 or T10.
        materials: region number → material.
        rest: node positions (n, 3) of the unloaded shape, mm.
    """

    def __init__(self, mesh: TetMesh, materials: Mapping[int, Material], rest: FloatArray) -> None:
        self.mesh = mesh
        self.rest = rest
        self._quadrature = quadrature(rest, mesh)
        # Elements are taken region by region, in chunks, so that each chunk has one law.
        self._chunks: list[tuple[IntArray, Law, Material]] = []
        for region in np.unique(mesh.region_numbers):
            elements = np.flatnonzero(mesh.region_numbers == region)
            law = find_law(materials[int(region)].law)
            parts = np.array_split(elements, max(1, -(-len(elements) // _CHUNK)))
            self._chunks += [(part, law, materials[int(region)]) for part in parts]

    def energy(self, positions: FloatArray) -> float:
        """Strain energy in µJ at node positions (n, 3); infinite where an element is inverted."""
        total = 0.0
        for elements, law, material in self._chunks:
            gradients = self._gradients(positions, elements)
            density = law.energy(gradients.reshape(-1, 3, 3), material)
            total += float(density @ self._quadrature.weights[elements].ravel())
        return total

    def forces(self, positions: FloatArray) -> FloatArray:
        """Internal forces ∂Ψ/∂x (n, 3) in mN."""
        forces = np.zeros_like(positions)
        for elements, law, material in self._chunks:
            gradients = self._gradients(positions, elements)
            stress = law.stress(gradients.reshape(-1, 3, 3), material).reshape(gradients.shape)
            parts = _element_forces(stress, self._quadrature.gradients, self._quadrature.weights, elements)
            flat = self.mesh.tetrahedra[elements].ravel()
            for i in range(3):
                forces[:, i] += np.bincount(flat, parts[:, :, i].ravel(), minlength=len(forces))
        return forces

    def add_stiffness(self, positions: FloatArray, pattern: BlockPattern, blocks: FloatArray, project: bool) -> None:
        """Add ∂²Ψ/∂x² to `blocks` (b, 3, 3).

        With `project`, negative eigenvalues of each point's ∂P/∂F are cut, which makes the sum positive
        semi-definite (Teran et al. 2005).
        """
        for elements, law, material in self._chunks:
            gradients = self._gradients(positions, elements)
            tangents = law.tangent(gradients.reshape(-1, 3, 3), material)
            if project:
                _cut_negative(tangents)
            weights = self._quadrature.weights[elements]
            parts = _element_stiffness(tangents, self._quadrature.gradients, weights, elements)
            _scatter_stiffness(parts, pattern.slots, elements, blocks)

    def jacobians(self, positions: FloatArray) -> FloatArray:
        """J = det F (m, q) at the quadrature points."""
        everything = np.arange(len(self.mesh.tetrahedra))
        result: FloatArray = np.linalg.det(self._gradients(positions, everything))
        return result

    def _gradients(self, positions: FloatArray, elements: IntArray) -> FloatArray:
        result: FloatArray = _deformation_gradients(
            positions, self.mesh.tetrahedra, self._quadrature.gradients, elements
        )
        return result


@njit(cache=True, parallel=True)
def _deformation_gradients(
    positions: FloatArray, tetrahedra: IntArray, gradients: FloatArray, elements: IntArray
) -> FloatArray:
    points, size = gradients.shape[1], gradients.shape[2]
    result = np.zeros((len(elements), points, 3, 3))
    for n in prange(len(elements)):
        e = elements[n]
        for q in range(points):
            for a in range(size):
                node = tetrahedra[e, a]
                for i in range(3):
                    for j in range(3):
                        result[n, q, i, j] += positions[node, i] * gradients[e, q, a, j]
    return result


@njit(cache=True, parallel=True)
def _element_forces(stress: FloatArray, gradients: FloatArray, weights: FloatArray, elements: IntArray) -> FloatArray:
    points, size = gradients.shape[1], gradients.shape[2]
    result = np.zeros((len(elements), size, 3))
    for n in prange(len(elements)):
        e = elements[n]
        for q in range(points):
            for a in range(size):
                for i in range(3):
                    value = 0.0
                    for j in range(3):
                        value += stress[n, q, i, j] * gradients[e, q, a, j]
                    result[n, a, i] += weights[e, q] * value
    return result


@njit(cache=True, parallel=True)
def _element_stiffness(
    tangents: FloatArray, gradients: FloatArray, weights: FloatArray, elements: IntArray
) -> FloatArray:
    """Sum w ∇Nᵀ A ∇N of each element as (k, nodes, nodes, 3, 3)."""
    points, size = gradients.shape[1], gradients.shape[2]
    result = np.zeros((len(elements), size, size, 3, 3))
    for n in prange(len(elements)):
        e = elements[n]
        half = np.zeros((3, 3, 3))
        for q in range(points):
            tangent = tangents[n * points + q]
            for b in range(size):
                for i in range(3):
                    for j in range(3):
                        for k in range(3):
                            value = 0.0
                            for m in range(3):
                                value += tangent[3 * i + j, 3 * k + m] * gradients[e, q, b, m]
                            half[i, j, k] = weights[n, q] * value
                for a in range(size):
                    for i in range(3):
                        for k in range(3):
                            value = 0.0
                            for j in range(3):
                                value += gradients[e, q, a, j] * half[i, j, k]
                            result[n, a, b, i, k] += value
    return result


@njit(cache=True)
def _scatter_stiffness(parts: FloatArray, slots: IntArray, elements: IntArray, blocks: FloatArray) -> None:
    for n in range(len(elements)):
        for a in range(parts.shape[1]):
            for b in range(parts.shape[2]):
                blocks[slots[elements[n], a, b]] += parts[n, a, b]


@njit(cache=True, parallel=True)
def _cut_negative(tangents: FloatArray) -> None:
    for n in prange(len(tangents)):
        values, vectors = np.linalg.eigh(tangents[n])
        if values[0] < 0.0:
            tangents[n] = (vectors * np.maximum(values, 0.0)) @ vectors.T
