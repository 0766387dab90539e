"""How the surface gives way close to a tool: the compliance at rest that the modes don't have.

Few modes are too stiff under a tool's tip, and what is wrong there turns the whole organ. With the compliance K⁻¹ of
the full model at rest, a force f on surface nodes moves the organ by (K⁻¹ − Φ (Φᵀ K Φ)⁻¹ Φᵀ) f beyond the modes Φ:
residual flexibility, as in component mode synthesis (Craig and Chang 1977). It turns with the organ.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.geometry.compiled import compiled
from glisson.geometry.rotations import nearest_rotation
from glisson.mechanics.pattern import Stiffness
from glisson.mechanics.reduced.full import FullModel

_ALL = slice(None)
_SAME = 1e-9  # share of forces by which they may leave a pattern


@dataclass(frozen=True, eq=False)
class LocalCompliance:
    """Residual displacements of unit forces on the surface nodes (k,) that tools reach.

    `nodes` are mesh numbers, ascending. `fields` (k, 3, n, 3) in mm/mN, in single precision, are the displacements of
    all nodes by a force on a node along an axis; `compliance` (k, 3, k, 3) is what of it is on the same nodes.
    """

    nodes: IntArray
    fields: FloatArray
    compliance: FloatArray

    def on_nodes(self, nodes: IntArray, forces: FloatArray) -> FloatArray:
        """Forces (k, 3) on the nodes that tools reach, of forces (m, 3) on mesh nodes (m,); others are left out."""
        places = np.minimum(np.searchsorted(self.nodes, nodes), len(self.nodes) - 1)
        reached = self.nodes[places] == nodes
        result = np.zeros((len(self.nodes), 3))
        np.add.at(result, places[reached], forces[reached])
        return result

    def displacement(self, forces: FloatArray, turn: FloatArray) -> FloatArray:
        """Of all nodes (n, 3) by forces (k, 3) in mN, where the organ has turned by `turn` (3, 3)."""
        pushed = np.flatnonzero(forces.any(axis=1))
        flat = self.fields.reshape(len(self.nodes), 3, -1)
        found = _summed(flat, pushed, (forces @ turn).astype(flat.dtype))
        result: FloatArray = found.reshape(-1, 3).astype(np.float64) @ turn.T
        return result

    @cached_property
    def mean_mm_per_mn(self) -> float:
        """By how much a node gives way to a force on it."""
        return float(np.einsum("kiki->", self.compliance)) / (3.0 * len(self.nodes))


@dataclass(frozen=True, eq=False)
class Pulled:
    """What pulls move beyond the modes: the sum of few patterns (j,) of `shares` (k, j) between the nodes.

    `fields` (j, 3, n, 3) in mm/mN are the displacements of a pattern's unit pull along each axis, `pulls` (j, 3) in mN.
    """

    shares: FloatArray
    fields: FloatArray
    pulls: FloatArray

    @classmethod
    def of(cls, local: LocalCompliance, forces: FloatArray) -> "Pulled":
        """Of forces (k, 3) on the nodes of a local compliance."""
        left, sizes, _ = np.linalg.svd(forces, full_matrices=False)
        shares = left[:, sizes > _SAME * sizes[0]]
        used = np.flatnonzero(shares.any(axis=1))
        fields = np.tensordot(shares[used].T.astype(local.fields.dtype), local.fields[used], 1)
        return cls(shares, fields, shares.T @ forces)

    def by(self, forces: FloatArray) -> "Pulled | None":
        """The same patterns by other forces (k, 3); None where these have other patterns."""
        pulls = self.shares.T @ forces
        apart = np.linalg.norm(forces - self.shares @ pulls)
        return replace(self, pulls=pulls) if apart <= _SAME * np.linalg.norm(forces) else None

    def displacement(self, turn: FloatArray, nodes: IntArray | slice = _ALL) -> FloatArray:
        """Of the nodes (m,) of the mesh, (m, 3) in mm, where the organ has turned by `turn` (3, 3)."""
        result: FloatArray = np.tensordot(self.pulls @ turn, self.fields[:, :, nodes], 2) @ turn.T
        return result


def turn_of(rest: FloatArray, places: FloatArray) -> FloatArray:
    """The rotation (3, 3) that takes nodes at rest (c, 3) nearest to where they are."""
    if len(rest) < 3:
        return np.eye(3)
    return nearest_rotation((places - places.mean(axis=0)).T @ (rest - rest.mean(axis=0)))


def local_compliance(full: FullModel, reach: IntArray, basis: FloatArray) -> LocalCompliance:
    """The compliance of the full model at the nodes `reach` (k,), beyond the modes (n, 3, r)."""
    nodes = np.unique(reach)
    blocks = np.zeros((full.pattern.block_count, 3, 3))
    full.elasticity.add_stiffness(full.rest, full.pattern, blocks, project=False)
    stiffness = Stiffness(full.pattern, full.system, blocks, full.rest)
    full.solver.factor(stiffness)
    flat = basis.reshape(-1, basis.shape[2])
    product = np.stack([stiffness.product(basis[:, :, r]).ravel() for r in range(basis.shape[2])], axis=1)
    answers = np.linalg.solve(flat.T @ product, flat.T)  # (r, 3 n): what the modes make of a force
    fields = np.zeros((len(nodes), 3, *full.rest.shape), dtype=np.float32)
    for number, node in enumerate(nodes):
        for axis in range(3):
            force = np.zeros_like(full.rest)
            force[node, axis] = 1.0
            moved = full.solver.solve(force, 0.0)
            assert moved is not None  # a direct solver has factored it
            fields[number, axis] = moved - (flat @ answers[:, 3 * node + axis]).reshape(force.shape)
    compliance = fields[:, :, nodes].astype(np.float64)
    return LocalCompliance(nodes, fields, 0.5 * (compliance + compliance.transpose(2, 3, 0, 1)))


@compiled
def _summed(fields: FloatArray, nodes: IntArray, forces: FloatArray) -> FloatArray:
    result = np.zeros(fields.shape[2], dtype=fields.dtype)
    for node in nodes:
        for axis in range(3):
            factor = forces[node, axis]
            row = fields[node, axis]
            for n in range(len(row)):
                result[n] += factor * row[n]
    return result
