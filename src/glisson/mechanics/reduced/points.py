"""Elastic energy, forces and stiffness in the modes, over chosen quadrature points."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.mesh import TetMesh
from glisson.core.model import Material
from glisson.geometry.compiled import compiled
from glisson.mechanics.elasticity import cut_negative
from glisson.mechanics.elements import quadrature
from glisson.mechanics.materials.law import law_of
from glisson.mechanics.reduced.minimise import rounding_uj

_IDENTITY = np.eye(3).ravel()


@dataclass(frozen=True, eq=False)
class ElasticPoints:
    """Points at which the body is strained by its modes.

    `strains` (m, 9, r) in 1/mm are the modes' displacement gradients, in double or single precision, `weights` (m,) in
    mm³, `regions` (m,) ascending.
    """

    strains: FloatArray
    weights: FloatArray
    regions: IntArray
    materials: Mapping[int, Material]

    @cached_property
    def _runs(self) -> list[tuple[slice, Material]]:
        numbers, firsts = np.unique(self.regions, return_index=True)
        ends = [*firsts[1:].tolist(), len(self.regions)]
        return [
            (slice(int(first), end), self.materials[int(number)])
            for number, first, end in zip(numbers, firsts, ends, strict=True)
        ]

    @cached_property
    def _flat(self) -> FloatArray:
        return np.ascontiguousarray(self.strains.reshape(-1, self.strains.shape[2]))

    @cached_property
    def rounding_uj(self) -> float:
        """By how much energies are uncertain, by rounding alone."""
        return sum(rounding_uj(m.young_modulus_kpa, float(self.weights[run].sum())) for run, m in self._runs)

    def gradients(self, modal: FloatArray) -> FloatArray:
        """Deformation gradients (m, 3, 3) at displacements by the first modes (≤ r,)."""
        result: FloatArray = (self._flat[:, : len(modal)] @ modal.astype(self._flat.dtype)).reshape(-1, 9) + _IDENTITY
        return result.reshape(-1, 3, 3)

    def energy(self, gradients: FloatArray) -> float:
        """Strain energy in µJ of deformation gradients; infinite where a chosen element is inverted."""
        return sum(
            float(law_of(material).energy(gradients[run], material) @ self.weights[run]) for run, material in self._runs
        )

    def stresses(self, gradients: FloatArray) -> FloatArray:
        """Stress times weight (m, 9)."""
        stress = np.concatenate([law_of(material).stress(gradients[run], material) for run, material in self._runs])
        result: FloatArray = stress.reshape(-1, 9) * self.weights[:, None]
        return result

    def forces(self, gradients: FloatArray) -> FloatArray:
        """Internal forces ∂Ψ/∂q (r,)."""
        result: FloatArray = self.stresses(gradients).ravel().astype(self._flat.dtype) @ self._flat
        return result

    def stiffness(self, gradients: FloatArray, project: bool = False) -> FloatArray:
        """∂²Ψ/∂q² (r, r); `project` makes each point's part positive semi-definite."""
        tangents = np.concatenate([law_of(material).tangent(gradients[run], material) for run, material in self._runs])
        if project:
            cut_negative(tangents)
        result: FloatArray = self._flat.T @ _weighted(tangents, self.weights, self.strains)
        return result


def elastic_points(mesh: TetMesh, materials: Mapping[int, Material], basis: FloatArray) -> ElasticPoints:
    """All quadrature points of a mesh, strained by the modes (n, 3, r); element by element, in the order of regions."""
    gradients, weights = quadrature(mesh.nodes, mesh)
    order = np.argsort(mesh.region_numbers, kind="stable")
    strains = _strains(mesh.tetrahedra[order], gradients[order], np.ascontiguousarray(basis))
    regions = np.repeat(mesh.region_numbers[order], weights.shape[1])
    return ElasticPoints(strains, weights[order].ravel(), regions, materials)


def some_points(every: ElasticPoints, points: IntArray, factors: FloatArray) -> ElasticPoints:
    """Those of the numbers (m,), with weights that are multiplied by the factors (m,)."""
    order = np.argsort(points)
    points = points[order]
    weights = every.weights[points] * factors[order]
    return ElasticPoints(every.strains[points], weights, every.regions[points], every.materials)


@compiled
def _strains(tetrahedra: IntArray, gradients: FloatArray, basis: FloatArray) -> FloatArray:
    points, size, modes = gradients.shape[1], gradients.shape[2], basis.shape[2]
    strains = np.zeros((len(tetrahedra) * points, 9, modes))
    for e in range(len(tetrahedra)):
        for q in range(points):
            for a in range(size):
                node = tetrahedra[e, a]
                for i in range(3):
                    for j in range(3):
                        slope = gradients[e, q, a, j]
                        for r in range(modes):
                            strains[e * points + q, 3 * i + j, r] += slope * basis[node, i, r]
    return strains


@compiled
def _weighted(tangents: FloatArray, weights: FloatArray, strains: FloatArray) -> FloatArray:
    """W A G of every point, as (9 m, r)."""
    modes = strains.shape[2]
    result = np.zeros((9 * len(weights), modes))
    for p in range(len(weights)):
        for row in range(9):
            line = result[9 * p + row]
            for column in range(9):
                value = weights[p] * tangents[p, row, column]
                if value != 0.0:
                    for r in range(modes):
                        line[r] += value * strains[p, column, r]
    return result
