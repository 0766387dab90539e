"""What was seen as scalar rows: each pulls one material point along one direction."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from glisson.core.arrays import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Rows:
    """r rows; the point of a row is Σ weight · node, and its residual direction · (seen − point) / sigma.

    Args:
        nodes: (r, a) node numbers.
        weights: (r, a) of the nodes.
        directions: (r, 3) unit vectors in the observations' frame.
        gaps_mm: (r,) direction · (seen − point).
        sigma_mm: (r,) standard deviation of the gap.
        point: (r,) number of the observed point that the row belongs to; its rows count or are set aside together.
        worth: (r,) how much the point counts beside others that are off together with it, 0 to 1.
        robust: (r,) whether the point may be an outlier.
        curve: (r,) number of the drawn curve that the point lies on, −1 for none.
    """

    nodes: IntArray
    weights: FloatArray
    directions: FloatArray
    gaps_mm: FloatArray
    sigma_mm: FloatArray
    point: IntArray
    worth: FloatArray
    robust: NDArray[np.bool_]
    curve: IntArray

    def some(self, chosen: IntArray) -> "Rows":
        """The rows of some numbers."""
        return Rows(*(getattr(self, field.name)[chosen] for field in fields(self)))

    @property
    def residuals(self) -> FloatArray:
        """Whitened gaps (r,)."""
        return self.gaps_mm / self.sigma_mm

    def squares(self, count: int) -> FloatArray:
        """Sum of the squares of the whitened gaps of each of `count` observed points."""
        squares = np.zeros(count)
        np.add.at(squares, self.point, self.residuals**2)
        return squares


def joined(parts: Sequence[Rows]) -> Rows:
    """All rows in one, in order. Points with fewer nodes than others get their last one again, without weight."""
    widest = max(part.nodes.shape[1] for part in parts)

    return Rows(
        nodes=np.concatenate([part.nodes[:, _columns(part, widest)] for part in parts]),
        weights=np.concatenate([_widened(part, widest) for part in parts]),
        directions=np.concatenate([part.directions for part in parts]),
        gaps_mm=np.concatenate([part.gaps_mm for part in parts]),
        sigma_mm=np.concatenate([part.sigma_mm for part in parts]),
        point=np.concatenate([part.point for part in parts]),
        worth=np.concatenate([part.worth for part in parts]),
        robust=np.concatenate([part.robust for part in parts]),
        curve=np.concatenate([part.curve for part in parts]),
    )


def _columns(part: Rows, widest: int) -> IntArray:
    columns: IntArray = np.minimum(np.arange(widest), part.nodes.shape[1] - 1)
    return columns


def _widened(part: Rows, widest: int) -> FloatArray:
    weights = np.zeros((len(part.weights), widest))
    weights[:, : part.weights.shape[1]] = part.weights
    return weights
