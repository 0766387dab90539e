"""Modes with what a hyperelastic body does at large amounts of them, to second order."""

import numpy as np

from glisson.core.arrays import FloatArray, IntArray
from glisson.mechanics.registration.floating import FloatingBody
from glisson.mechanics.registration.motion import BasisMotion, MotionState

_STEP = 0.02
"""Amount of a mode at which curvature is taken by differences."""

_ITERATIONS = 3


class SecondOrderMotion(BasisMotion):
    """x = c + R (X + Φ a + ½ aᵀ Θ a − c) + t.

    Args:
        nodes: X (n, 3), mm.
        basis: Φ (n, 3, k).
        precision: P (k, k) of the cost ½ aᵀ P a.
        second: Θ (n, 3, r, r), symmetric, for the first r amounts.
    """

    def __init__(self, nodes: FloatArray, basis: FloatArray, precision: FloatArray, second: FloatArray) -> None:
        super().__init__(nodes, basis, precision)
        self._second = second

    def nearest(self, positions: FloatArray) -> MotionState:
        """See `BasisMotion`."""
        state = super().nearest(positions)
        for _ in range(_ITERATIONS):
            bent = self._turned_by(state.amounts) / 2.0 @ self._first(state.amounts)
            state = super().nearest(positions - bent @ state.rotation.T)
        return state

    def shape(self, amounts: FloatArray) -> FloatArray:
        """See `BasisMotion`."""
        return super().shape(amounts) + self._turned_by(amounts) / 2.0 @ self._first(amounts)

    def slopes(self, amounts: FloatArray, nodes: IntArray) -> FloatArray:
        """See `BasisMotion`."""
        slopes = super().slopes(amounts, nodes).copy()
        slopes[:, :, : self._second.shape[2]] += self._second[nodes] @ self._first(amounts)
        return slopes

    def _first(self, amounts: FloatArray) -> FloatArray:
        return amounts[: self._second.shape[2]]

    def _turned_by(self, amounts: FloatArray) -> FloatArray:
        turned: FloatArray = self._second @ self._first(amounts)
        return turned


def second_derivatives(body: FloatingBody, basis: FloatArray) -> FloatArray:
    """How a body follows dead forces to second order (modal derivatives, Idelsohn and Cardona 1985).

    The forces that make Φ a when all is linear make Φ a + ½ aᵀ Θ a, as K Θ = − ∂K/∂a Φ; a rigid motion is left out.

    Args:
        body: the organ without supports.
        basis: Φ (n, 3, r).

    Returns:
        Θ (n, 3, r, r), symmetric.
    """
    elasticity, count = body.elasticity, basis.shape[2]
    rest = elasticity.mesh.nodes

    def curvature(direction: FloatArray) -> FloatArray:
        forward, back = (elasticity.forces(rest + side * direction) for side in (_STEP, -_STEP))
        curved: FloatArray = (forward + back) / _STEP**2
        return curved

    own = [curvature(basis[:, :, i]) for i in range(count)]
    second = np.zeros((*rest.shape, count, count))
    for i in range(count):
        for j in range(i + 1):
            pulls = own[i] if i == j else 0.5 * (curvature(basis[:, :, i] + basis[:, :, j]) - own[i] - own[j])
            second[:, :, i, j] = second[:, :, j, i] = -body.response(pulls)
    return second
