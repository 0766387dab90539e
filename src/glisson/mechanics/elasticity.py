"""Elastic energy, internal forces and stiffness of the organ, assembled over its elements."""

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numba import njit

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.mechanics.elements import quadrature
from glisson.mechanics.materials.law import Law, find_law
from glisson.mechanics.pattern import BlockPattern

_CHUNK = 4096  # elements whose tangents and stiffness are held at once (about 40 MB for T10)
_CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


T = TypeVar("T")

# Threads and not compiled parallel loops: these wait in turns that cost milliseconds on a busy machine.
_threads = ThreadPoolExecutor(_CORES, thread_name_prefix="glisson-elasticity")


@dataclass(frozen=True, eq=False)
class _Chunk:
    """Elements of one region that are worked on together."""

    elements: IntArray
    law: Law
    material: Material


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
        self._chunks: list[_Chunk] = []
        size = min(_CHUNK, -(-len(mesh.tetrahedra) // _CORES))
        for region in np.unique(mesh.region_numbers):
            elements = np.flatnonzero(mesh.region_numbers == region)
            law = find_law(materials[int(region)].law)
            parts = np.array_split(elements, -(-len(elements) // size))
            self._chunks += [_Chunk(part, law, materials[int(region)]) for part in parts]

    def energy(self, positions: FloatArray) -> float:
        """Strain energy in µJ at node positions (n, 3); infinite where an element is inverted."""

        def part(chunk: _Chunk) -> float:
            gradients = self._gradients(positions, chunk.elements).reshape(-1, 3, 3)
            weights = self._quadrature.weights[chunk.elements].ravel()
            return float(chunk.law.energy(gradients, chunk.material) @ weights)

        return sum(self._each_chunk(part))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Internal forces ∂Ψ/∂x (n, 3) in mN."""

        def part(chunk: _Chunk) -> FloatArray:
            gradients = self._gradients(positions, chunk.elements)
            stress = chunk.law.stress(gradients.reshape(-1, 3, 3), chunk.material).reshape(gradients.shape)
            parts = _element_forces(stress, self._quadrature.gradients, self._quadrature.weights, chunk.elements)
            flat = self.mesh.tetrahedra[chunk.elements].ravel()
            count = len(positions)
            return np.stack([np.bincount(flat, parts[:, :, i].ravel(), minlength=count) for i in range(3)], axis=1)

        forces: FloatArray = np.sum(self._each_chunk(part), axis=0)
        return forces

    def add_stiffness(self, positions: FloatArray, pattern: BlockPattern, blocks: FloatArray, project: bool) -> None:
        """Add ∂²Ψ/∂x² to `blocks` (b, 3, 3).

        With `project`, negative eigenvalues of each point's ∂P/∂F are cut, which makes the sum positive
        semi-definite (Teran et al. 2005).
        """

        def tangents(gradients: FloatArray, chunk: _Chunk) -> FloatArray:
            found = chunk.law.tangent(gradients, chunk.material)
            if project:
                _cut_negative(found)
            return found

        self._assemble(tangents, positions, pattern, blocks)

    def add_rest_derivative(self, positions: FloatArray, pattern: BlockPattern, blocks: FloatArray) -> None:
        """Add the derivative of the internal forces by the unloaded positions, ∂²Ψ/∂x∂X, to `blocks` (b, 3, 3).

        With x held and X moved by δX the deformation gradient changes by −F ∇δX. Pulled back to the unloaded
        shape this is −A : (F ∇δX) ∇N_a, and two terms of P from the change of ∇N and of the volume; the
        matrix is not symmetric.
        """

        def tangents(gradients: FloatArray, chunk: _Chunk) -> FloatArray:
            tangent = chunk.law.tangent(gradients, chunk.material)
            return _rest_tangents(tangent, chunk.law.stress(gradients, chunk.material), gradients)

        self._assemble(tangents, positions, pattern, blocks)

    def _assemble(
        self,
        tangents: Callable[[FloatArray, _Chunk], FloatArray],
        positions: FloatArray,
        pattern: BlockPattern,
        blocks: FloatArray,
    ) -> None:
        """Add Σ w ∇Nᵀ T ∇N, with T (n, 9, 9) from the deformation gradients (n, 3, 3) of a chunk."""

        def part(chunk: _Chunk) -> FloatArray:
            found = tangents(self._gradients(positions, chunk.elements).reshape(-1, 3, 3), chunk)
            weights = self._quadrature.weights[chunk.elements]
            stiffness: FloatArray = _element_stiffness(found, self._quadrature.gradients, weights, chunk.elements)
            return stiffness

        # As many chunks at a time as there are cores, so that memory stays bounded.
        for first in range(0, len(self._chunks), _CORES):
            chunks = self._chunks[first : first + _CORES]
            for chunk, parts in zip(chunks, _threads.map(part, chunks), strict=True):
                _scatter_stiffness(parts, pattern.slots, chunk.elements, blocks)

    def _each_chunk(self, work: Callable[[_Chunk], T]) -> list[T]:
        return list(_threads.map(work, self._chunks))

    def _gradients(self, positions: FloatArray, elements: IntArray) -> FloatArray:
        result: FloatArray = _deformation_gradients(
            positions, self.mesh.tetrahedra, self._quadrature.gradients, elements
        )
        return result


@njit(cache=True, nogil=True)
def _deformation_gradients(
    positions: FloatArray, tetrahedra: IntArray, gradients: FloatArray, elements: IntArray
) -> FloatArray:
    points, size = gradients.shape[1], gradients.shape[2]
    result = np.zeros((len(elements), points, 3, 3))
    for n in range(len(elements)):
        e = elements[n]
        for q in range(points):
            for a in range(size):
                node = tetrahedra[e, a]
                for i in range(3):
                    for j in range(3):
                        result[n, q, i, j] += positions[node, i] * gradients[e, q, a, j]
    return result


@njit(cache=True, nogil=True)
def _element_forces(stress: FloatArray, gradients: FloatArray, weights: FloatArray, elements: IntArray) -> FloatArray:
    points, size = gradients.shape[1], gradients.shape[2]
    result = np.zeros((len(elements), size, 3))
    for n in range(len(elements)):
        e = elements[n]
        for q in range(points):
            for a in range(size):
                for i in range(3):
                    value = 0.0
                    for j in range(3):
                        value += stress[n, q, i, j] * gradients[e, q, a, j]
                    result[n, a, i] += weights[e, q] * value
    return result


@njit(cache=True, nogil=True)
def _element_stiffness(
    tangents: FloatArray, gradients: FloatArray, weights: FloatArray, elements: IntArray
) -> FloatArray:
    """Sum w ∇Nᵀ A ∇N of each element as (k, nodes, nodes, 3, 3)."""
    points, size = gradients.shape[1], gradients.shape[2]
    result = np.zeros((len(elements), size, size, 3, 3))
    for n in range(len(elements)):
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


@njit(cache=True, nogil=True)
def _scatter_stiffness(parts: FloatArray, slots: IntArray, elements: IntArray, blocks: FloatArray) -> None:
    for n in range(len(elements)):
        for a in range(parts.shape[1]):
            for b in range(parts.shape[2]):
                slot = slots[elements[n], a, b]
                for i in range(3):
                    for j in range(3):
                        blocks[slot, i, j] += parts[n, a, b, i, j]


@njit(cache=True, nogil=True)
def _cut_negative(tangents: FloatArray) -> None:
    for n in range(len(tangents)):
        values, vectors = np.linalg.eigh(tangents[n])
        if values[0] < 0.0:
            tangents[n] = (vectors * np.maximum(values, 0.0)) @ vectors.T


@njit(cache=True, nogil=True)
def _rest_tangents(tangents: FloatArray, stress: FloatArray, gradients: FloatArray) -> FloatArray:
    """−A F − P_iM 1_Jk + P_iJ 1_kM as (n, 9, 9), rows iJ and columns kM."""
    result = np.zeros_like(tangents)
    for n in range(len(tangents)):
        for row in range(9):
            for k in range(3):
                for m in range(3):
                    value = 0.0
                    for i in range(3):
                        value -= tangents[n, row, 3 * i + m] * gradients[n, i, k]
                    result[n, row, 3 * k + m] = value
        for i in range(3):
            for j in range(3):
                for m in range(3):
                    result[n, 3 * i + j, 3 * j + m] -= stress[n, i, m]
                    result[n, 3 * i + j, 3 * m + m] += stress[n, i, j]
    return result
