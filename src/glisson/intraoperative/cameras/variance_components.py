"""Least squares where two kinds of error of unknown size meet, such as a tracker's in angle and in place."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from glisson.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Blocks:
    """Linear observations in n independent blocks of m: residuals = jacobian @ x + error.

    The error of a block has the covariance known + size₁² parts₁ + size₂² parts₂ …

    Args:
        residuals: (n, m).
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
        normal = np.einsum("bmp,bmq->pq", self.jacobian, weighted) + self.prior
        return np.linalg.solve(normal, np.einsum("bmp,bm->p", weighted, self.residuals)), normal

    def covariance(self, normal: FloatArray) -> FloatArray:
        """The covariance (p, p) of the unknowns for sizes that are themselves estimates.

        With ν observations to spare the unknowns follow Student's distribution, whose variance is ν / (ν − 2) larger.
        """
        spare = max(self.residuals.size - normal.shape[0] + np.linalg.matrix_rank(self.prior), 3)
        result: FloatArray = np.linalg.inv(normal) * (spare / (spare - 2.0))
        return result

    def sizes(self, start: FloatArray) -> FloatArray:
        """The sizes (k,) of greatest restricted likelihood (Patterson and Thompson 1971).

        A size that the residuals do not show comes out at a thousandth of its start.
        """
        found = minimize(
            lambda logarithms: self._unlikeliness(start * np.exp(logarithms)),
            np.zeros(len(start)),
            method="L-BFGS-B",
            bounds=[(np.log(1e-3), np.log(1e3))] * len(start),
        )
        result: FloatArray = start * np.exp(found.x)
        return result

    def _covariance(self, sizes: FloatArray) -> FloatArray:
        total: FloatArray = self.known + np.einsum("k,kbij->bij", sizes**2, self.parts)
        return total

    def _unlikeliness(self, sizes: FloatArray) -> float:
        covariance = self._covariance(sizes)
        unknowns, normal = self.solved(sizes)
        rest = self.residuals - self.jacobian @ unknowns
        squares = np.einsum("bi,bi->", rest, np.linalg.solve(covariance, rest[:, :, None])[:, :, 0])
        squares += unknowns @ self.prior @ unknowns
        logarithms = np.linalg.slogdet(covariance)[1].sum() + np.linalg.slogdet(normal)[1]
        return float(logarithms + squares)
