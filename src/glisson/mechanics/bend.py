"""How the way of a body through its loads bends, as its last load step tells."""

from dataclasses import dataclass

from glisson.core.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Bend:
    """The last load step (n, 3) in mm, and how long the next one is beside it.

    A first-order answer misses what is of second order in the load. The parabola that begins with it and passes through
    where the last step began misses the third order only, for nothing (the midpoint rule where both steps are alike).
    """

    ratio: float
    last: FloatArray

    def bent(self, positions: FloatArray, moved: FloatArray) -> FloatArray:
        """Positions (n, 3) on that parabola, from where the body is and the first-order answer, (n, 3) each."""
        curved: FloatArray = moved + self.ratio * (moved - positions) - self.ratio**2 * self.last
        return curved
