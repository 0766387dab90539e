"""Least squares where kinds of error of unknown size meet, such as a tracker's in angle and in place."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from glisson.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Blocks:
    """Linear observations in n independent blocks of m: residuals = jacobian @ x + error.

    The error of a block has the covariance known + size₁² parts₁ + size₂² parts₂ …

    Args:
        residuals: (n, m), small: where they are not, likelihoods are differences of large numbers.
        jacobian: (n, m, p).
        known: (n, m, m).
        parts: (k, n, m, m).
        prior: what is known of the unknowns beforehand, an information matrix (p, p); they are about 0.
    """

    residuals: FloatArray
    jacobian: FloatArray
    known: FloatArray
    parts: FloatArray
    prior: FloatArray

    def weights(self, sizes: FloatArray) -> FloatArray:
        """The inverse covariance (n, m, m) of each block for sizes (k,)."""
        return np.asarray(np.linalg.inv(self._covariance(sizes)), dtype=np.float64)

    def solved(self, sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The unknowns x (p,) with the least weighted squares, and the normal matrix (p, p)."""
        weighted = self.weights(sizes) @ self.jacobian
        normal = np.tensordot(self.jacobian, weighted, axes=((0, 1), (0, 1))) + self.prior
        right = np.tensordot(weighted, self.residuals, axes=((0, 1), (0, 1)))
        return np.asarray(np.linalg.solve(normal, right), dtype=np.float64), normal

    def covariance(self, normal: FloatArray) -> FloatArray:
        """The covariance (p, p) of the unknowns for sizes that are themselves estimates.

        With ν observations to spare the unknowns follow Student's distribution, whose variance is ν / (ν − 2) larger.
        """
        spare = max(self.residuals.size - normal.shape[0] + np.linalg.matrix_rank(self.prior), 3)
        result: FloatArray = np.linalg.inv(normal) * (spare / (spare - 2.0))
        return result

    def sizes(self, starts: FloatArray) -> FloatArray:
        """The sizes (k,) of greatest restricted likelihood (Patterson and Thompson 1971).

        The likelihood may have several peaks: it is climbed from each of `starts` (m, k). A size that the residuals do
        not show comes out at a thousandth of its start.
        """
        climbed = [
            minimize(
                lambda logarithms, start=start: self._unlikeliness(start * np.exp(logarithms)),
                np.zeros(len(start)),
                method="L-BFGS-B",
                bounds=[(np.log(1e-3), np.log(1e3))] * len(start),
            )
            for start in starts
        ]
        best = min(range(len(starts)), key=lambda number: float(climbed[number].fun))
        result: FloatArray = starts[best] * np.exp(climbed[best].x)
        return result

    def _covariance(self, sizes: FloatArray) -> FloatArray:
        total: FloatArray = self.known + np.einsum("k,kbij->bij", sizes**2, self.parts)
        return total

    def _unlikeliness(self, sizes: FloatArray) -> float:
        weights = self.weights(sizes)
        weighted = weights @ self.jacobian
        normal = np.tensordot(self.jacobian, weighted, axes=((0, 1), (0, 1))) + self.prior
        right = np.tensordot(weighted, self.residuals, axes=((0, 1), (0, 1)))
        squares = np.einsum("bm,bmn,bn->", self.residuals, weights, self.residuals)
        squares -= right @ np.linalg.solve(normal, right)
        logarithms = np.linalg.slogdet(normal)[1] - np.linalg.slogdet(weights)[1].sum()
        return float(logarithms + squares)
