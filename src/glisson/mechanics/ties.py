"""Ties between parts of a mesh that do not share nodes, by Lagrange multipliers (dissertation, section 2.6.2).

C(x) = x_s − Σ N_b(s) x_b = 0 for every tied node s and the element of the other part in which it lies. The equations
are R(x) + (∂C/∂x)ᵀ λ = 0 and C(x) = 0; the multipliers λ are found with the positions (method of multipliers,
Hestenes 1969), so that the stiffness stays definite.
"""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.core.errors import BadInput
from glisson.core.mesh import TetMesh
from glisson.core.model import Model
from glisson.geometry.location import PointLocator

_FARTHEST_MM = 1.0  # from the other part
_STIFFNESS_MODULI = 50.0  # of the spring that helps the multipliers, over the modulus times the tied nodes' spacing


class Ties:
    """A `Part`: the nodes of some sets stay in the elements beside them in which they lie in A.

    Args:
        model: its mesh, materials and node sets.
        names: of the tied sets.

    Raises:
        BadInput: a node lies away from all other parts.
    """

    def __init__(self, model: Model, names: tuple[str, ...]) -> None:
        groups, weights = zip(*(_tied(model.mesh, name, model.node_set(name)) for name in names), strict=True)
        self._groups: IntArray = np.vstack(groups)
        self._weights: FloatArray = np.vstack(weights)
        stiffest = max(material.young_modulus_kpa for material in model.materials.values())
        spacing = float(np.cbrt(model.mesh.corner_volumes_mm3.mean()))
        self._stiffness = _STIFFNESS_MODULI * stiffest * spacing
        self._gaps_in_a = self._spread(model.mesh.nodes)
        self._multipliers = np.zeros((len(self._groups), 3))

    def energy(self, positions: FloatArray) -> float:
        """λ · C + ½ k |C|² in µJ."""
        gaps = self._gaps(positions)
        return float(np.vdot(self._multipliers + 0.5 * self._stiffness * gaps, gaps))

    def forces(self, positions: FloatArray) -> FloatArray:
        """Forces (n, 3) in mN."""
        pulls = self._multipliers + self._stiffness * self._gaps(positions)
        forces = np.zeros_like(positions)
        np.add.at(forces, self._groups, -self._weights[:, :, None] * pulls[:, None, :])
        return forces

    def stiffness(self, positions: FloatArray, project: bool) -> tuple[IntArray, FloatArray]:
        """That of the springs, always definite."""
        pairs = self._stiffness * self._weights[:, :, None] * self._weights[:, None, :]
        local: FloatArray = pairs[..., None, None] * np.eye(3)
        return self._groups, local

    def renew(self, positions: FloatArray) -> None:
        """Let the multipliers bear what the springs bore."""
        self._multipliers = self._multipliers + self._stiffness * self._gaps(positions)

    def accept(self, positions: FloatArray) -> None:
        """Nothing slips."""

    def memory(self) -> FloatArray:
        """The multipliers (k, 3) in mN."""
        return self._multipliers

    def recall(self, memory: FloatArray) -> None:
        """Put them back."""
        self._multipliers = memory

    def _gaps(self, positions: FloatArray) -> FloatArray:
        """C (k, 3) in mm, counted from A."""
        return self._spread(positions) - self._gaps_in_a

    def _spread(self, positions: FloatArray) -> FloatArray:
        spread: FloatArray = np.einsum("ka,kai->ki", self._weights, positions[self._groups])
        return spread


def _tied(mesh: TetMesh, name: str, nodes: IntArray) -> tuple[IntArray, FloatArray]:
    """Groups (k, 1 + a) of a tied node and its element's nodes, and their weights in C."""
    others = np.flatnonzero(~np.isin(mesh.tetrahedra, nodes).any(axis=1))
    if not len(others):
        raise BadInput(f"There is no other part to which the node set {name!r} could be tied.")
    locator = PointLocator(TetMesh(mesh.nodes, mesh.tetrahedra[others]))
    location = locator.locate(mesh.nodes[nodes])
    farthest = float(location.distance_mm.max())
    if farthest > _FARTHEST_MM:
        raise BadInput(f"The node set {name!r} lies up to {farthest:.1f} mm away from the part it should be tied to.")
    hosts = mesh.tetrahedra[others[location.elements]]
    return np.column_stack([nodes, hosts]), np.column_stack([np.ones(len(nodes)), -locator.weights(location)])
