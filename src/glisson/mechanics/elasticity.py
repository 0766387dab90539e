"""Elastic energy, internal forces and stiffness of the organ, assembled over its elements."""

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numba import njit

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.core.protocols import MaterialLaw
from glisson.mechanics.elements import ElementQuadrature, quadrature
from glisson.mechanics.materials.law import law_of
from glisson.mechanics.pattern import BlockPattern, Index

_CHUNK = 2048  # quadrature points whose tangents are held at once, small enough for a core's cache
_CORES = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


T = TypeVar("T")

# Threads and not compiled parallel loops: these wait in turns that cost milliseconds on a busy machine.
_threads = ThreadPoolExecutor(_CORES, thread_name_prefix="glisson-elasticity")


@dataclass(frozen=True, eq=False)
class _Chunk:
    """Elements of one region that are worked on together."""

    elements: IntArray
    law: MaterialLaw
    material: Material


class Elasticity:
    """The elastic body.

    Args:
        mesh: the elements; T4 or T10.
        materials: region number → material.
        rest: node positions (n, 3) of the unloaded shape, mm.
    """

    def __init__(self, mesh: TetMesh, materials: Mapping[int, Material], rest: FloatArray) -> None:
        self.mesh, self.materials = mesh, materials
        self.rest = rest
        self.softest_kpa = min(materials[int(n)].young_modulus_kpa for n in np.unique(mesh.region_numbers))
        self._quadrature = quadrature(rest, mesh)
        # Each core has a run of chunks, and each chunk one law.
        parts = np.array_split(np.arange(len(mesh.tetrahedra)), min(_CORES, len(mesh.tetrahedra)))
        self._runs = [
            [
                chunk
                for region in np.unique(mesh.region_numbers[part])
                for chunk in self._chunks(part, region, materials)
            ]
            for part in parts
        ]
        self._node_ranges = [(int(mesh.tetrahedra[p].min()), int(mesh.tetrahedra[p].max())) for p in parts]

    def unloaded_at(self, rest: FloatArray) -> "Elasticity":
        """The same body with another unloaded shape (n, 3) in mm."""
        other = copy(self)
        other.rest, other._quadrature = rest, quadrature(rest, self.mesh)
        return other

    def _chunks(self, part: IntArray, region: int, materials: Mapping[int, Material]) -> list[_Chunk]:
        """The elements of one region among those of the numbers `part`."""
        elements = part[self.mesh.region_numbers[part] == region]
        material = materials[int(region)]
        law = law_of(material)
        count = -(-len(elements) * self._quadrature.weights.shape[1] // _CHUNK)
        return [_Chunk(piece, law, material) for piece in np.array_split(elements, count)]

    def energy(self, positions: FloatArray) -> float:
        """Strain energy in µJ at node positions (n, 3); infinite where an element is inverted."""

        def of(chunk: _Chunk) -> float:
            gradients = self._gradients(positions, chunk.elements).reshape(-1, 3, 3)
            weights = self._quadrature.weights[chunk.elements].ravel()
            return float(chunk.law.energy(gradients, chunk.material) @ weights)

        return sum(self._each_run(lambda run: sum(of(chunk) for chunk in run)))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Internal forces ∂Ψ/∂x (n, 3) in mN."""

        def of(run: Sequence[_Chunk]) -> FloatArray:
            forces = np.zeros_like(positions)
            for chunk in run:
                gradients = self._gradients(positions, chunk.elements)
                stress = chunk.law.stress(gradients.reshape(-1, 3, 3), chunk.material).reshape(gradients.shape)
                _add_forces(stress, self._quadrature, self.mesh.tetrahedra, chunk.elements, forces)
            return forces

        forces: FloatArray = np.sum(self._each_run(of), axis=0)
        return forces

    def add_stiffness(self, positions: FloatArray, pattern: BlockPattern, blocks: FloatArray, project: bool) -> None:
        """Add ∂²Ψ/∂x² to `blocks` (b, 3, 3).

        With `project`, negative eigenvalues of each point's ∂P/∂F are cut, which makes the sum positive
        semi-definite (Teran et al. 2005).
        """

        def tangents(gradients: FloatArray, chunk: _Chunk) -> FloatArray:
            found = chunk.law.tangent(gradients, chunk.material)
            if project:
                cut_negative(found)
            return found

        self._assemble(tangents, positions, pattern, blocks, symmetric=True)

    def add_rest_derivative(self, positions: FloatArray, pattern: BlockPattern, blocks: FloatArray) -> None:
        """Add the derivative of the internal forces by the unloaded positions, ∂²Ψ/∂x∂X, to `blocks` (b, 3, 3).

        With x held and X moved by δX the deformation gradient changes by −F ∇δX. Pulled back to the unloaded
        shape this is −A : (F ∇δX) ∇N_a, and two terms of P from the change of ∇N and of the volume; the
        matrix is not symmetric.
        """

        def tangents(gradients: FloatArray, chunk: _Chunk) -> FloatArray:
            tangent = chunk.law.tangent(gradients, chunk.material)
            return _rest_tangents(tangent, chunk.law.stress(gradients, chunk.material), gradients)

        self._assemble(tangents, positions, pattern, blocks, symmetric=False)

    def _assemble(
        self,
        tangents: Callable[[FloatArray, _Chunk], FloatArray],
        positions: FloatArray,
        pattern: BlockPattern,
        blocks: FloatArray,
        symmetric: bool,
    ) -> None:
        """Add Σ w ∇Nᵀ T ∇N, with T (n, 9, 9) from the deformation gradients (n, 3, 3) of a chunk."""
        # What a core and the one before it both add to is collected apart, else they would overwrite each other.
        ends = np.maximum.accumulate([pattern.indptr[last + 1] for _, last in self._node_ranges])
        firsts = [int(pattern.indptr[first]) for first, _ in self._node_ranges]
        shared = list(zip(firsts, [0, *ends[:-1].tolist()], strict=True))

        def add(run: Sequence[_Chunk], first: int, end: int) -> FloatArray:
            apart = np.zeros((max(end - first, 0), 3, 3))
            for chunk in run:
                found = tangents(self._gradients(positions, chunk.elements).reshape(-1, 3, 3), chunk)
                _add_stiffness(found, self._quadrature, pattern.slots, chunk.elements, blocks, apart, first, symmetric)
            return apart

        parts = list(_threads.map(add, self._runs, *zip(*shared, strict=True)))
        for (first, end), apart in zip(shared, parts, strict=True):
            if len(apart):
                blocks[first:end] += apart

    def _each_run(self, work: Callable[[Sequence[_Chunk]], T]) -> list[T]:
        return list(_threads.map(work, self._runs))

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
def _add_forces(
    stress: FloatArray, quadrature: ElementQuadrature, tetrahedra: IntArray, elements: IntArray, forces: FloatArray
) -> None:
    gradients, weights = quadrature
    for n in range(len(elements)):
        e = elements[n]
        for q in range(gradients.shape[1]):
            for a in range(gradients.shape[2]):
                node = tetrahedra[e, a]
                for i in range(3):
                    value = 0.0
                    for j in range(3):
                        value += stress[n, q, i, j] * gradients[e, q, a, j]
                    forces[node, i] += weights[e, q] * value


@njit(cache=True, nogil=True, fastmath={"contract", "reassoc", "nsz"})
def _add_stiffness(
    tangents: FloatArray,
    quadrature: ElementQuadrature,
    slots: Index,
    elements: IntArray,
    blocks: FloatArray,
    apart: FloatArray,
    first: int,
    symmetric: bool,
) -> None:
    """Add Σ w ∇Nᵀ T ∇N of each element to `blocks`, or to `apart` where the slot lies in its range from `first` on.

    The innermost loops run over the nine entries of a block, so that they become vector instructions.
    """
    gradients, weights = quadrature
    points, size = gradients.shape[1], gradients.shape[2]
    matrix, half, tangent = np.zeros((size, size, 9)), np.zeros((3, 9)), np.zeros((3, 3, 9))
    for n in range(len(elements)):
        e = elements[n]
        matrix[:] = 0.0
        for q in range(points):
            point, weight = n * points + q, weights[e, q]
            for m in range(3):
                for j in range(3):
                    for i in range(3):
                        for k in range(3):
                            tangent[m, j, 3 * i + k] = weight * tangents[point, 3 * i + j, 3 * k + m]
            for b in range(size):
                x, y, z = gradients[e, q, b, 0], gradients[e, q, b, 1], gradients[e, q, b, 2]
                for j in range(3):
                    for c in range(9):
                        half[j, c] = tangent[0, j, c] * x + tangent[1, j, c] * y + tangent[2, j, c] * z
                for a in range(b + 1 if symmetric else size):
                    u, v, w = gradients[e, q, a, 0], gradients[e, q, a, 1], gradients[e, q, a, 2]
                    for c in range(9):
                        matrix[a, b, c] += u * half[0, c] + v * half[1, c] + w * half[2, c]
        for a in range(size):
            for b in range(a if symmetric else 0, size):
                _add_block(matrix[a, b], slots[e, a, b], False, blocks, apart, first)
                if symmetric and a < b:
                    _add_block(matrix[a, b], slots[e, b, a], True, blocks, apart, first)


@njit(cache=True, nogil=True)
def _add_block(
    values: FloatArray, slot: int, transposed: bool, blocks: FloatArray, apart: FloatArray, first: int
) -> None:
    target = apart[slot - first] if first <= slot < first + len(apart) else blocks[slot]
    for i in range(3):
        for k in range(3):
            target[i, k] += values[3 * k + i] if transposed else values[3 * i + k]


@njit(cache=True, nogil=True)
def cut_negative(tangents: FloatArray) -> None:
    """Set the negative eigenvalues of tangents (n, 9, 9) to zero, in place."""
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
