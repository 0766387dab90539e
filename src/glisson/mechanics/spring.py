"""The organ as a patch of its surface feels it: a small dense spring."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import LinAlgError, cho_factor
from scipy.linalg.lapack import dpotri

from glisson.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Spring:
    """Stiffness (k, k) in mN/mm of the patch's free unknowns, those of the rest of the organ being condensed."""

    stiffness: FloatArray

    @cached_property
    def compliance(self) -> FloatArray | None:
        """The inverse (k, k) in mm/mN; None where the stiffness is not positive definite."""
        try:
            factor, _ = cho_factor(self.stiffness, lower=True, check_finite=False)
        except LinAlgError:
            return None
        half, _ = dpotri(factor, lower=True)
        inverse: FloatArray = np.tril(half) + np.tril(half, -1).T
        return inverse

    def candidates(self, near: bool) -> Iterator["Spring"]:
        """The exact spring where it is definite or equilibrium is `near`, then one of an organ that can't buckle.

        Against a spring that gives way contact may have no equilibrium at all.
        """
        if near or self.compliance is not None:
            yield self
        yield self._bounded

    @cached_property
    def _bounded(self) -> "Spring":
        """The same eigenvalues, the negative ones with their signs turned."""
        values, vectors = np.linalg.eigh(self.stiffness)
        return Spring((vectors * np.abs(values)) @ vectors.T)
