"""Preconditioned conjugate gradients; the preconditioner is kept as long as it serves."""

from typing import Protocol

import numpy as np

from glisson.core.arrays import FloatArray
from glisson.mechanics.linear_solvers.vectors import add_scaled, dot, norm, scale_and_add
from glisson.mechanics.pattern import Stiffness

_LIMIT = 300


class Preconditioner(Protocol):
    """A cheap symmetric approximation of an inverse."""

    price: int
    """What building it costs, in iterations that it is used for."""

    def build(self, matrix: Stiffness) -> bool:
        """Fit it to a matrix; False where that is not positive definite."""

    def renew(self, matrix: Stiffness) -> None:
        """Let it follow another matrix as far as that costs next to nothing."""

    def apply(self, right: FloatArray) -> FloatArray:
        """Its answer (n, 3) to a right-hand side (n, 3)."""

    def close(self) -> None:
        """Give its memory back."""


class ConjugateGradients:
    """Solves to the accuracy that is asked for.

    The preconditioner is built anew when keeping it has cost as many iterations as building is worth.
    """

    def __init__(self, preconditioner: Preconditioner) -> None:
        self._preconditioner = preconditioner
        self._fresh = self._built = False
        self._digits_per_iteration = self._wasted = 0.0

    def factor(self, matrix: Stiffness) -> bool:
        """Take a matrix; False where it is known not to be positive definite."""
        self._matrix = matrix
        if self._built and self._wasted < self._preconditioner.price:
            self._preconditioner.renew(matrix)
            return True
        self._built = self._fresh = self._preconditioner.build(matrix)
        self._wasted = 0.0
        return self._built

    def solve(self, right: FloatArray, accuracy: float) -> FloatArray | None:
        """Field (n, 3) whose product with the matrix is `right` (n, 3) up to `accuracy` of its norm.

        None where a direction without positive stiffness was found.
        """
        matrix = self._matrix
        left = np.where(matrix.held, 0.0, right)
        whole = size = norm(left)
        solution, direction, before, product_before = np.zeros_like(left), np.zeros_like(left), left.copy(), np.inf
        iterations = 0
        while size > accuracy * whole and iterations < _LIMIT:
            iterations += 1
            scaled = self._preconditioner.apply(left)
            # The form that bears with a preconditioner's rounding (Golub and Ye 1999, SIAM J. Sci. Comput. 21).
            product = dot(left, scaled)
            scale_and_add(direction, (product - dot(before, scaled)) / product_before, scaled)
            pushed = matrix.symmetric_product(direction)
            stiffness = dot(direction, pushed)
            if not (product > 0.0 and stiffness > 0.0):
                return None
            length = product / stiffness
            add_scaled(solution, length, direction)
            before[:], product_before = left, product
            add_scaled(left, -length, pushed)
            size = norm(left)
        if iterations:
            self._judge(iterations, float(np.log10(whole / max(size, 1e-300))))
        return solution

    def precondition(self, right: FloatArray) -> FloatArray:
        """A rough solution (n, 3)."""
        return self._preconditioner.apply(np.where(self._matrix.held, 0.0, right))

    def close(self) -> None:
        """Give the preconditioner's memory back."""
        self._preconditioner.close()
        self._built = False

    def _judge(self, iterations: int, digits: float) -> None:
        if self._fresh:
            self._digits_per_iteration, self._fresh = digits / iterations, False
        else:
            self._wasted += max(iterations - digits / self._digits_per_iteration, 0.0)
